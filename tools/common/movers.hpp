// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Parts that move beside that of the first hand, for those who draw them: the driven and the loose
/// ones, and behind these that of a second hand.

#include <cstdint>

#include "rt_core/scene/part_scenes.hpp"

namespace haptic::tools {

/// Those of a scene, at most.
inline constexpr std::uint32_t kMostMovers = kMostDriven;

[[nodiscard]] std::uint32_t mover_count(const PartScenes& parts) noexcept;
/// Number of the part of a mover.
[[nodiscard]] std::uint32_t part_of_mover(const PartScenes& parts, std::uint32_t mover) noexcept;
/// It is held by a second hand.
[[nodiscard]] bool is_held_by_second(const PartScenes& parts, std::uint32_t mover) noexcept;

/// Opens a scene in which the mover is body `body`, whose vertices are about its reference_m: for a
/// driven part that of it, where it stands alone at its mesh frame, and the first part which may be
/// held and meets it. @return false: it meets no part, and the compiled scene does not have its
/// shape. Cost: O(bytes of that scene).
[[nodiscard]] bool open_mover_shape(const PartScenes& parts, std::uint32_t mover, SceneView& scene,
                                    std::uint32_t& body) noexcept;

}  // namespace haptic::tools
