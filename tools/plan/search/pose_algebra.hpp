// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Poses of a plan as the planner computes with them: double, also where the core has float.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tools/plan/plan.hpp"

namespace haptic::tools {

using Vec3d = Eigen::Vector3d;
using Quatd = Eigen::Quaterniond;

[[nodiscard]] inline Vec3d place_of(const PlanPose& pose) {
  return {pose.x0_m[0], pose.x0_m[1], pose.x0_m[2]};
}
[[nodiscard]] inline Quatd turn_of(const PlanPose& pose) {
  return {pose.q_wxyz[0], pose.q_wxyz[1], pose.q_wxyz[2], pose.q_wxyz[3]};
}
[[nodiscard]] inline PlanPose plan_pose(const Vec3d& x0_m, const Quatd& q) {
  const Quatd unit = q.normalized();
  PlanPose pose;
  for (int k = 0; k < 3; ++k) pose.x0_m[static_cast<std::size_t>(k)] = x0_m[k];
  pose.q_wxyz = {unit.w(), unit.x(), unit.y(), unit.z()};
  return pose;
}

/// Rotation vector of `q`, by the shorter way [rad].
[[nodiscard]] inline Vec3d log_of(const Quatd& q) {
  const double sine = q.vec().norm();
  if (!(sine > 0)) return Vec3d::Zero();
  const double angle = 2 * std::atan2(sine, std::abs(q.w()));
  return (q.w() < 0 ? -angle : angle) / sine * q.vec();
}
[[nodiscard]] inline Quatd exp_of(const Vec3d& turn_rad) {
  const double angle = turn_rad.norm();
  if (!(angle > 0)) return Quatd::Identity();
  return Quatd(Eigen::AngleAxisd(angle, turn_rad / angle));
}

/// The rotation vector from one pose to another, W axes.
[[nodiscard]] inline Vec3d turn_between(const PlanPose& from, const PlanPose& to) {
  return log_of(turn_of(to) * turn_of(from).conjugate());
}
/// The pose after a share of the straight step.
[[nodiscard]] inline PlanPose between(const PlanPose& from, const PlanPose& to, double share) {
  return plan_pose(place_of(from) + share * (place_of(to) - place_of(from)),
                   exp_of(share * turn_between(from, to)) * turn_of(from));
}

}  // namespace haptic::tools
