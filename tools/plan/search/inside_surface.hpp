// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Whether the part lies inside the material of a closed surface, of which the scene has the skin
/// alone: no facet is near there, and the pose seems free.

#include <cstdint>
#include <optional>

#include "rt_core/scene/scene_view.hpp"
#include "tools/plan/search/pose_algebra.hpp"

namespace haptic::tools {

/// The static body whose surface the part lies in at a pose, or which lies in the part's own; none
/// where the solid angle of no surface is whole turns but 0, as in front of an opening. No facet
/// may be crossed at the pose. Cost: facets times 32.
[[nodiscard]] std::optional<std::uint32_t> enclosing_body(const SceneView& scene,
                                                          const PlanPose& pose);

}  // namespace haptic::tools
