// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/planning/sampling_planners.hpp"

#include <ompl/base/MotionValidator.h>
#include <ompl/base/objectives/PathLengthOptimizationObjective.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/est/EST.h>
#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/geometric/planners/kpiece/KPIECE1.h>
#include <ompl/geometric/planners/prm/LazyPRMstar.h>
#include <ompl/geometric/planners/prm/PRM.h>
#include <ompl/geometric/planners/rrt/BiTRRT.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/geometric/planners/rrt/TRRT.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <stdexcept>

#include "host_sim/lab/planning/ompl_poses.hpp"
#include "host_sim/lab/planning/processor_time.hpp"

namespace haptic::sim {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;
using Space = ob::SE3StateSpace;

/// Straight ways by their proof instead of samples along them.
class ProvedMotions : public ob::MotionValidator {
 public:
  ProvedMotions(const ob::SpaceInformationPtr& space, const SamplingProblem& problem)
      : ob::MotionValidator(space), problem_(problem) {}
  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    return problem_.is_way_free(pose_of(from), pose_of(to));
  }
  /// The farthest of a few places on the way that is reached.
  bool checkMotion(const ob::State* from, const ob::State* to,
                   std::pair<ob::State*, double>& last) const override {
    if (checkMotion(from, to)) return true;
    ob::State* const middle = si_->allocState();
    last.second = 0;
    double reach = 1;
    for (int k = 0; k < 4; ++k) {
      const double share = last.second + reach / 2;
      reach /= 2;
      si_->getStateSpace()->interpolate(from, to, share, middle);
      if (si_->isValid(middle) && checkMotion(from, middle)) last.second = share;
    }
    if (last.first != nullptr) si_->getStateSpace()->interpolate(from, to, last.second, last.first);
    si_->freeState(middle);
    return false;
  }

 private:
  const SamplingProblem& problem_;
};

ob::PlannerPtr planner_of(const std::string& name, const ob::SpaceInformationPtr& space) {
  if (name == "RRTConnect") return std::make_shared<og::RRTConnect>(space);
  if (name == "BiTRRT") return std::make_shared<og::BiTRRT>(space);
  if (name == "TRRT") return std::make_shared<og::TRRT>(space);
  if (name == "PRM") return std::make_shared<og::PRM>(space);
  if (name == "LazyPRMstar") return std::make_shared<og::LazyPRMstar>(space);
  if (name == "KPIECE1") return std::make_shared<og::KPIECE1>(space);
  if (name == "EST") return std::make_shared<og::EST>(space);
  if (name == "BITstar") return std::make_shared<og::BITstar>(space);
  throw std::invalid_argument("no planner is called '" + name + "'");
}

}  // namespace

const std::vector<std::string>& sampling_planners() {
  static const std::vector<std::string> names{"RRTConnect",  "BiTRRT",  "TRRT", "PRM",
                                              "LazyPRMstar", "KPIECE1", "EST",  "BITstar"};
  return names;
}

SamplingResult run_sampling_planner(const std::string& name, const SamplingProblem& problem,
                                    double seconds, std::uint32_t seed) {
  ompl::msg::noOutputHandler();
  ompl::RNG::setSeed(seed + 1);
  const auto space = space_of(problem);
  og::SimpleSetup setup(space);
  const ob::SpaceInformationPtr& info = setup.getSpaceInformation();
  setup.setStateValidityChecker(
      [&](const ob::State* state) { return problem.is_free(pose_of(state)); });
  info->setMotionValidator(std::make_shared<ProvedMotions>(info, problem));
  ob::ScopedState<Space> start(space), goal(space);
  set_pose(problem.start, *start);
  set_pose(problem.goal, *goal);
  setup.setStartAndGoalStates(start, goal, 1e-9);
  const auto length = std::make_shared<ob::PathLengthOptimizationObjective>(info);
  length->setCostThreshold(length->infiniteCost());  // any way will do
  setup.setOptimizationObjective(length);
  setup.setPlanner(planner_of(name, info));
  // Of the process: PRM asks from a thread of its own, too, whether its time is over.
  const double began_s = process_processor_s();
  const auto taken_s = [&] { return process_processor_s() - began_s; };
  const ob::PlannerStatus status = setup.solve(ob::plannerOrTerminationCondition(
      ob::PlannerTerminationCondition([&] { return taken_s() > seconds; }),
      ob::exactSolnPlannerTerminationCondition(setup.getProblemDefinition())));
  SamplingResult result;
  result.seconds = taken_s();
  result.solved = status == ob::PlannerStatus::EXACT_SOLUTION;
  if (!result.solved) return result;
  for (const ob::State* state : setup.getSolutionPath().getStates())
    result.way.push_back(pose_of(state));
  return result;
}

}  // namespace haptic::sim
