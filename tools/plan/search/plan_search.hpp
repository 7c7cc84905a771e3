// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Search for a motion between two poses by pushing the felt part about: two trees of poses with
/// their contact states, one from the start and one from the goal, where the part of an assembly is
/// held most and few motions are left (assembly by disassembly). A branch is a push: towards the
/// other tree, along what the planes that hold the part leave, along and about the axes, or to a
/// random pose: near the straight way at first, and the longer nothing is found the farther from
/// it, as far as the obstacles and the scene's workspace reach. Steps of the core are certified in
/// both directions, so a branch may be walked back.
///
/// Same scene, poses and seed: same result, unless the time ends the search.

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tools/plan/search/sliding_part.hpp"
#include "tools/plan/search/step_prover.hpp"

namespace haptic::tools {

/// A clock on the wall [s].
[[nodiscard]] double wall_clock_s();

struct SearchLimits {
  double seconds = 120;
  double (*clock_s)() = wall_clock_s;  ///< what the seconds are of
  std::uint64_t most_nodes = 200'000;
  /// Ticks of the core in this search: unlike seconds the same on any machine.
  std::uint64_t most_ticks = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t seed = 1;
};

struct SearchState {
  double seconds = 0;
  std::uint64_t nodes_from_start = 0, nodes_from_goal = 0, pushes = 0, ticks = 0;
  double nearest_m = 0;  ///< of two poses, one of each tree, that were compared; a turn at radius
};

struct SearchResult {
  bool found = false;
  bool timed_out = false;
  CorneredMotion motion;  ///< found: from the start to the goal
  SearchState state;
  PlanPose nearest_to_start;            ///< of the tree from the goal
  PlanPose nearest_to_goal;             ///< of the tree from the start
  std::vector<HoldingPlane> goal_held;  ///< by what the part is held there when pushed out
};

/// @param progress  called about once a second.
[[nodiscard]] SearchResult search_plan(const SceneView& scene, SlidingPart& part,
                                       StepProver& prover, const PlanPose& start,
                                       const PlanPose& goal, const SearchLimits& limits,
                                       const std::function<void(const SearchState&)>& progress);

}  // namespace haptic::tools
