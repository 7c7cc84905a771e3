// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Poses as states of OMPL.

#include <ompl/base/PlannerTerminationCondition.h>
#include <ompl/base/spaces/SE3StateSpace.h>

#include <memory>

#include "host_sim/lab/planning/sampling_planners.hpp"

namespace haptic::sim {

inline tools::PlanPose pose_of(const ompl::base::State* state) {
  const auto* const s = state->as<ompl::base::SE3StateSpace::StateType>();
  return {{s->getX(), s->getY(), s->getZ()},
          {s->rotation().w, s->rotation().x, s->rotation().y, s->rotation().z}};
}

inline void set_pose(const tools::PlanPose& pose, ompl::base::SE3StateSpace::StateType& state) {
  state.setXYZ(pose.x0_m[0], pose.x0_m[1], pose.x0_m[2]);
  state.rotation().w = pose.q_wxyz[0];
  state.rotation().x = pose.q_wxyz[1];
  state.rotation().y = pose.q_wxyz[2];
  state.rotation().z = pose.q_wxyz[3];
}

/// The places of the problem and all orientations.
inline std::shared_ptr<ompl::base::SE3StateSpace> space_of(const SamplingProblem& problem) {
  auto space = std::make_shared<ompl::base::SE3StateSpace>();
  ompl::base::RealVectorBounds bounds(3);
  for (unsigned k = 0; k < 3; ++k) {
    bounds.setLow(k, problem.low_m[k]);
    bounds.setHigh(k, problem.high_m[k]);
  }
  space->setBounds(bounds);
  // Distance in SO(3) is half the angle.
  space->setSubspaceWeight(1, 2 * problem.turn_m);
  return space;
}

}  // namespace haptic::sim
