// SPDX-License-Identifier: Apache-2.0
#include <ompl/control/DirectedControlSampler.h>
#include <ompl/control/PathControl.h>
#include <ompl/control/SimpleSetup.h>
#include <ompl/control/planners/rrt/RRT.h>
#include <ompl/control/spaces/RealVectorControlSpace.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include "host_sim/lab/planning/ompl_poses.hpp"
#include "host_sim/lab/planning/processor_time.hpp"

namespace haptic::sim {
namespace {

namespace ob = ompl::base;
namespace oc = ompl::control;

/// All slides so far. A control is the number of one.
using Slides = std::vector<std::vector<tools::PlanPose>>;

double& number_in(oc::Control* control) {
  return control->as<oc::RealVectorControlSpace::ControlType>()->values[0];
}

/// Steers by sliding: wherever that ends is the new state.
class SlideSampler : public oc::DirectedControlSampler {
 public:
  SlideSampler(const oc::SpaceInformation* info, const SlideTowards& slide, Slides& slides)
      : oc::DirectedControlSampler(info), slide_(slide), slides_(slides) {}

  unsigned int sampleTo(oc::Control* control, const ob::State* from, ob::State* to) override {
    std::vector<tools::PlanPose> way = slide_(pose_of(from), pose_of(to));
    if (way.empty()) return 0;
    set_pose(way.back(), *to->as<ob::SE3StateSpace::StateType>());
    number_in(control) = static_cast<double>(slides_.size());
    slides_.push_back(std::move(way));
    return 1;
  }
  unsigned int sampleTo(oc::Control* control, const oc::Control*, const ob::State* from,
                        ob::State* to) override {
    return sampleTo(control, from, to);
  }

 private:
  const SlideTowards& slide_;
  Slides& slides_;
};

}  // namespace

SamplingResult run_sliding_rrt(const SamplingProblem& problem, const SlideTowards& slide,
                               double goal_m, double seconds, std::uint32_t seed) {
  ompl::msg::noOutputHandler();
  ompl::RNG::setSeed(seed + 1);
  Slides slides;
  const auto space = space_of(problem);
  const auto numbers = std::make_shared<oc::RealVectorControlSpace>(space, 1);
  ob::RealVectorBounds any(1);
  any.setLow(0);
  any.setHigh(9e15);
  numbers->setBounds(any);
  oc::SimpleSetup setup(numbers);
  const oc::SpaceInformationPtr& info = setup.getSpaceInformation();
  info->setPropagationStepSize(1);
  info->setMinMaxControlDuration(1, 1);
  info->setDirectedControlSamplerAllocator([&](const oc::SpaceInformation* of) {
    return std::make_shared<SlideSampler>(of, slide, slides);
  });
  setup.setStateValidityChecker(
      [&](const ob::State* state) { return problem.is_free(pose_of(state)); });
  setup.setStatePropagator(
      [&](const ob::State*, const oc::Control* control, double, ob::State* to) {
        const double number = control->as<oc::RealVectorControlSpace::ControlType>()->values[0];
        set_pose(slides[static_cast<std::size_t>(number)].back(),
                 *to->as<ob::SE3StateSpace::StateType>());
      });
  ob::ScopedState<ob::SE3StateSpace> start(space), goal(space);
  set_pose(problem.start, *start);
  set_pose(problem.goal, *goal);
  setup.setStartAndGoalStates(start, goal, goal_m);
  setup.setPlanner(std::make_shared<oc::RRT>(info));
  const double began_s = process_processor_s();
  const auto taken_s = [&] { return process_processor_s() - began_s; };
  const ob::PlannerStatus status =
      setup.solve(ob::PlannerTerminationCondition([&] { return taken_s() > seconds; }));
  SamplingResult result;
  result.seconds = taken_s();
  result.solved = status == ob::PlannerStatus::EXACT_SOLUTION;
  if (!result.solved) return result;
  result.way.push_back(problem.start);
  for (oc::Control* control : setup.getSolutionPath().getControls()) {
    const auto& way = slides[static_cast<std::size_t>(number_in(control))];
    result.way.insert(result.way.end(), way.begin(), way.end());
  }
  result.way.push_back(problem.goal);
  return result;
}

}  // namespace haptic::sim
