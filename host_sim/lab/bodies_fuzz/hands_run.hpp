// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The hands of a scene file under the same random goals, as every program moves them: cores with
/// clutch and springs, driven parts by their streams, loose parts with their anchors.

#include <cstdint>
#include <optional>
#include <string>

#include "host_sim/lab/bodies_fuzz/bodies_scene.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_session.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_totals.hpp"

namespace haptic::sim {

/// Run `number` of a campaign of this seed. After each tick no two parts may be deeper in each
/// other than allowed, every number must be finite, and the work within the bound.
/// @param compiled  the bodies of the file (bodies_of_file).
/// @throws tools::InputError when the scene is refused.
[[nodiscard]] BodiesTotals run_hands(const std::string& scene, const CompiledBodies& compiled,
                                     std::uint64_t ticks, std::uint64_t seed, std::uint64_t number,
                                     std::optional<BodiesFault> fault);

}  // namespace haptic::sim
