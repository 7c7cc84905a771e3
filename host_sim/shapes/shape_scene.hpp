// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Scenes of the bodies made here, with every parameter of the rendering chosen by the caller.

#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

/// Compiled scene of A over one static body made of `pieces`; grip point at A's origin.
/// A tick visits at most `max_pair_visits` pairs.
/// @throws tools::InputError when a solid is not closed or a parameter is refused.
[[nodiscard]] std::vector<std::byte> scene_with(const Solid& a, std::span<const Solid> pieces,
                                                const SceneParameters& parameters,
                                                std::uint32_t max_pair_visits = kDefaultPairVisits);

}  // namespace haptic::sim
