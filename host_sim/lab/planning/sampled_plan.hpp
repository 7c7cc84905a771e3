// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Plans by the planners of OMPL on our verdict, where the search by pushing finds none.

#include <functional>
#include <optional>
#include <string>

#include "host_sim/lab/planning/sampling_planners.hpp"
#include "tools/plan/plan.hpp"
#include "tools/plan/search/sliding_part.hpp"
#include "tools/plan/search/step_prover.hpp"

namespace haptic::sim {

/// Halvings of a straight way of theirs, and of a step of ours.
inline constexpr int kWayHalvings = 14;

/// Start and goal with some room about them; the prover must outlive it.
[[nodiscard]] SamplingProblem sampling_problem(const tools::SlidingPart& part,
                                               tools::StepProver& prover,
                                               const tools::PlanPose& start,
                                               const tools::PlanPose& goal);

struct SampledPlan {
  std::string planner;
  double seconds = 0;  ///< of a processor, until its way was found
  tools::Plan plan;
};

/// The plan of the first that finds a way: OMPL's RRT steered by the felt part, then the planners
/// of sampling_planners(); each for `seconds` of a processor. Each step of a plan is proved like
/// those of any other. @param tell  which begins, if any. @return nothing: none found a way, or
/// nothing of OMPL was built in.
[[nodiscard]] std::optional<SampledPlan> sampled_plan(
    const SceneView& scene, const tools::PlanPose& start, const tools::PlanPose& goal,
    double seconds, std::uint32_t seed, const std::function<void(const std::string&)>& tell = {});

}  // namespace haptic::sim
