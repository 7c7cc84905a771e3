// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The shape of a driven part, for those who draw it.

#include <cstdint>

#include "rt_core/scene/part_scenes.hpp"

namespace haptic::tools {

/// Opens a scene in which driven part `driven` is body 1, alone, at its mesh frame: that of it and
/// the first part which may be held and meets it. @return false: it meets no part, and the compiled
/// scene does not have its shape. Cost: O(bytes of that scene).
[[nodiscard]] bool open_driven_shape(const PartScenes& parts, std::uint32_t driven,
                                     SceneView& scene) noexcept;

}  // namespace haptic::tools
