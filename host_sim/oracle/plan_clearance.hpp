// SPDX-License-Identifier: Apache-2.0
#pragma once
/// How much room a plan leaves: the distance between the surfaces of the part and of the fixed
/// bodies at many poses of its way, exact to rounding. The planes of a plan prove that each step is
/// free, and no more than that: they leave micrometres where millimetres are free.

#include <cstddef>

#include "rt_core/scene/scene_view.hpp"
#include "tools/plan/plan.hpp"

namespace haptic::sim {

struct PlanClearance {
  double least_m = 0;     ///< smallest distance at the poses looked at; 0: the surfaces touch
  tools::PlanPose at;     ///< where that is
  std::size_t poses = 0;  ///< looked at, the start and the goal among them
  double apart_m = 0;     ///< of two poses looked at in succession, at most; a turn of 1 rad counts
                          ///< as the plan's length_m
};

/// Looks at the ends of all steps and at places between them, evenly along the way, as many as
/// about a second of work allows; where the steps are more than that, at some of their ends. The
/// same poses on every machine. Cost: that of a distance of two meshes at each pose.
[[nodiscard]] PlanClearance clearance_of(const SceneView& scene, const tools::Plan& plan);

}  // namespace haptic::sim
