// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A hand that tries to get energy out of a guide.

#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/base/pose.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic::sim {

struct HostileRun {
  double stated_j = 0;              ///< the most that the scene says the guide can do
  double most_j = 0;                ///< the most that it had done at any time
  std::uint64_t on = 0, ticks = 0;  ///< ticks in which the guide led; all
};

/// Where the grip point is when the part's mesh frame is at a pose.
[[nodiscard]] Vec3 grip_place(const SceneView& scene, const Pose& pose);

/// From the scene's start: along the guide's force and against it, to and fro, drifts, noise,
/// always turning a little, jumps back to the start with a reset, and the switch now and then. The
/// device takes all of the wrench. @throws tools::InputError  the scene has no guide.
[[nodiscard]] HostileRun run_hostile_hand(std::span<const std::byte> scene, std::uint64_t ticks,
                                          std::uint64_t seed);

}  // namespace haptic::sim
