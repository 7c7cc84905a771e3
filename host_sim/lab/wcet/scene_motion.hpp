// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A motion for the worst-case tests of a scene that comes without one.

#include <cstdint>
#include <vector>

#include "host_sim/session/core_session.hpp"

namespace haptic::sim {

/// At the scene's rate: half of `seconds` the pressing script (there, press, slide, back), then a
/// seeded wander through poses about the pressed one, shifts up to a fifth of A's radius and turns
/// up to 0.4 rad, with the tremor of a hand all the while. Same scene, seed and length, same
/// samples. `seconds` > 0.
[[nodiscard]] std::vector<MotionSample> scene_motion(CoreSession& session, double seconds,
                                                     std::uint64_t seed);

/// Largest distance of a vertex of A from the mean of its piece, over the pieces of A [m].
[[nodiscard]] double moving_radius_m(const SceneView& view);

}  // namespace haptic::sim
