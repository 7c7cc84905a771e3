// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/planning/sampled_plan.hpp"

#include <algorithm>
#include <utility>

#include "tools/plan/search/plan_making.hpp"

namespace haptic::sim {
namespace {

/// Room about start and goal for the sampling planners, in radii of the part.
constexpr double kRoom = 2.5;
/// A slide that ends nearer than this to the goal is there, in radii.
constexpr double kAtGoal = 1.0e-6;
constexpr const char* kSteered = "RRT steered by the felt part";

/// The corners of a way whose straight parts are all proved.
std::optional<tools::CorneredMotion> proved(const std::vector<tools::PlanPose>& way,
                                            tools::StepProver& prover) {
  tools::CorneredMotion motion{{way.front()}};
  for (const tools::PlanPose& pose : way) {
    if (pose == motion.corners.back()) continue;
    if (!prover.prove(motion.corners.back(), pose, kWayHalvings)) return std::nullopt;
    motion.corners.push_back(pose);
  }
  return motion;
}

}  // namespace

SamplingProblem sampling_problem(const tools::SlidingPart& part, tools::StepProver& prover,
                                 const tools::PlanPose& start, const tools::PlanPose& goal) {
  SamplingProblem problem;
  problem.start = start;
  problem.goal = goal;
  problem.turn_m = part.radius_m();
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [low, high] = std::minmax(start.x0_m[k], goal.x0_m[k]);
    problem.low_m[k] = low - kRoom * part.radius_m();
    problem.high_m[k] = high + kRoom * part.radius_m();
  }
  problem.is_free = [&prover](const tools::PlanPose& pose) { return prover.is_free(pose); };
  problem.is_way_free = [&prover](const tools::PlanPose& from, const tools::PlanPose& to) {
    return prover.prove(from, to, kWayHalvings);
  };
  return problem;
}

std::optional<SampledPlan> sampled_plan(const SceneView& scene, const tools::PlanPose& start,
                                        const tools::PlanPose& goal, double seconds,
                                        std::uint32_t seed,
                                        const std::function<void(const std::string&)>& tell) {
  if (sampling_planners().empty()) return std::nullopt;
  tools::SlidingPart part(scene);
  tools::StepProver prover(scene, tools::plan_tolerance_m(scene));
  const SamplingProblem problem = sampling_problem(part, prover, start, goal);
  // Out of the assembly few ways lead, and into it they must be met: slides go from the goal.
  SamplingProblem apart = problem;
  std::swap(apart.start, apart.goal);
  const SlideTowards slide = [&](const tools::PlanPose& from, const tools::PlanPose& towards) {
    std::vector<tools::PlanPose> way;
    part.place(from);
    static_cast<void>(part.push(towards, {}, way));
    return way;
  };
  std::vector<std::string> names{kSteered};
  names.insert(names.end(), sampling_planners().begin(), sampling_planners().end());
  for (const std::string& name : names) {
    if (tell) tell(name);
    SamplingResult found =
        name == kSteered ? run_sliding_rrt(apart, slide, kAtGoal * part.radius_m(), seconds, seed)
                         : run_sampling_planner(name, problem, seconds, seed);
    if (!found.solved) continue;
    if (name == kSteered) std::ranges::reverse(found.way);
    const std::optional<tools::CorneredMotion> motion = proved(found.way, prover);
    if (!motion) continue;
    tools::ShorteningLimits shortening;
    shortening.seed = seed;
    return SampledPlan{
        name, found.seconds,
        tools::plan_from(scene, part, prover,
                         tools::shortened(*motion, prover, part.radius_m(), shortening), seed)};
  }
  return std::nullopt;
}

}  // namespace haptic::sim
