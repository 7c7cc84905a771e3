// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The planners of OMPL (Sucan, Moll, Kavraki 2012) on our verdict, to compare with and to fall
/// back on: present where the library is found when this is built (Debian's libompl-dev).

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tools/plan/plan_pose.hpp"

namespace haptic::sim {

/// Whether poses and straight steps are free, in a box of places and all orientations.
struct SamplingProblem {
  tools::PlanPose start, goal;
  std::array<double, 3> low_m{}, high_m{};
  double turn_m = 0;  ///< that a turn of 1 rad counts as
  std::function<bool(const tools::PlanPose&)> is_free;
  std::function<bool(const tools::PlanPose&, const tools::PlanPose&)> is_way_free;
};

struct SamplingResult {
  bool solved = false;
  double seconds = 0;                ///< of a processor
  std::vector<tools::PlanPose> way;  ///< solved: free straight ways from start to goal
};

/// Names of the planners that were built in; empty: none.
[[nodiscard]] const std::vector<std::string>& sampling_planners();

/// `seconds` of a processor at most, by the clock of the process, which must run nothing else
/// meanwhile. @throws std::invalid_argument for a name that is not in the
/// list.
[[nodiscard]] SamplingResult run_sampling_planner(const std::string& name,
                                                  const SamplingProblem& problem, double seconds,
                                                  std::uint32_t seed);

/// From a pose towards another: the poses of free straight ways, the last of which was reached.
using SlideTowards = std::function<std::vector<tools::PlanPose>(const tools::PlanPose& from,
                                                                const tools::PlanPose& towards)>;

/// OMPL's RRT, steered by motions that slide along what is in the way instead of ending there.
/// Time, seed and way as for run_sampling_planner; `goal_m`: it is there when it is so near.
/// @throws std::invalid_argument  nothing of OMPL was built in.
[[nodiscard]] SamplingResult run_sliding_rrt(const SamplingProblem& problem,
                                             const SlideTowards& slide, double goal_m,
                                             double seconds, std::uint32_t seed);

}  // namespace haptic::sim
