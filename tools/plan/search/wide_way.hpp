// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A cheaper way than one that is given (way_cost.hpp), also far from it: a shortest way through a
/// graph of poses. The poses are places on the given way; the same moved to where the clearance is
/// largest; its places with the orientation of start and goal; and places straight out of start and
/// goal along the axes. In a hole most of them are not free, and those that are lie where a part is
/// led best: a peg goes in along its goal's axis, upright.

#include <functional>
#include <vector>

#include "tools/plan/search/way_cost.hpp"

namespace haptic::tools {

/// What the graph is made with.
struct WideWayTools {
  StepProver& prover;
  double turn_m = 0;
  int halvings = 0;            ///< that the proof of an edge may take
  std::function<bool()> over;  ///< the work is done up to its limit
};

/// `corners` joined by proved straight ways. @return corners like them that cost no more.
[[nodiscard]] std::vector<PlanPose> wide_way(const std::vector<PlanPose>& corners,
                                             const WideWayTools& with);

}  // namespace haptic::tools
