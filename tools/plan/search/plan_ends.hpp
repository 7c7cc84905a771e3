// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Start and goal of a plan: checked before anything is searched.

#include <string>

#include "rt_core/scene/scene_view.hpp"
#include "tools/plan/search/sliding_part.hpp"
#include "tools/plan/search/step_prover.hpp"

namespace haptic::tools {

/// The two poses, and how a message calls them.
struct AskedEnds {
  Pose start_wa, goal_wa;  ///< of the mesh frame
  std::string start_name = "start", goal_name = "goal";
};

struct PlanEnds {
  PlanPose start, goal;  ///< of the grip point
  bool turned = false;   ///< the goal is turned against the start
};

/// @throws UsageError  a place that a plan file cannot hold, or the goal is the start;
///         InputError  a pose beyond the scene's limits, across an obstacle, or within the closed
///         surface of one. Cost: facets times 32, and a look at all pairs of pieces, for each end.
[[nodiscard]] PlanEnds checked_ends(const SceneView& scene, const SlidingPart& part,
                                    StepProver& prover, const AskedEnds& asked);

}  // namespace haptic::tools
