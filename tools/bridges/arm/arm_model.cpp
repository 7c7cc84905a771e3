// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/arm/arm_model.hpp"

#include <cmath>

namespace haptic::tools {
namespace {

/// Rodrigues: the turn about a unit axis.
Square3 turn_about(const Column3& axis, double angle_rad) noexcept {
  const double s = std::sin(angle_rad), c = std::cos(angle_rad);
  Square3 cross;
  cross << 0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0;
  return Square3::Identity() + s * cross + (1 - c) * (cross * cross);
}

}  // namespace

ArmPlace place_of(const ArmModel& model, const JointNumbers& angles_rad) noexcept {
  ArmPlace place;
  place.joint_count = model.joint_count;
  // A point at x_b in the zero pose is at turn x_b + shift in D.
  Square3 turn = model.turn_db;
  Column3 shift = model.origin_d;
  for (std::size_t k = 0; k < model.joint_count; ++k) {
    const ArmJoint& joint = model.joints[k];
    place.axis[k] = turn * joint.axis_b;
    place.point[k] = turn * joint.point_b + shift;
    turn = (turn * turn_about(joint.axis_b, angles_rad[k])).eval();
    shift = place.point[k] - turn * joint.point_b;
    place.carried[k].mass_kg = joint.carried.mass_kg;
    place.carried[k].centre_b = turn * joint.carried.centre_b + shift;
  }
  place.tip = turn * model.tip_b + shift;
  place.turn_dh = turn * model.turn_bh;
  return place;
}

JacobianColumn jacobian_column(const ArmPlace& place, std::size_t joint) noexcept {
  return {place.axis[joint].cross(place.tip - place.point[joint]), place.axis[joint]};
}

JointNumbers torques_of(const ArmPlace& place, const Column3& force_d,
                        const Column3& torque_d) noexcept {
  JointNumbers torques{};
  for (std::size_t k = 0; k < place.joint_count; ++k) {
    const JacobianColumn column = jacobian_column(place, k);
    torques[k] = column.linear.dot(force_d) + column.angular.dot(torque_d);
  }
  return torques;
}

JointNumbers weight_torques(const ArmPlace& place) noexcept {
  JointNumbers torques{};
  // From the handle to the base: mass and moment of all that a joint carries.
  double mass_kg = 0;
  Column3 moment = Column3::Zero();
  for (std::size_t k = place.joint_count; k-- > 0;) {
    mass_kg += place.carried[k].mass_kg;
    moment += place.carried[k].mass_kg * place.carried[k].centre_b;
    // d(m g z)/dq: what the joint has to exert against it.
    torques[k] = kGravity_m_per_s2 * place.axis[k].cross(moment - mass_kg * place.point[k]).z();
  }
  return torques;
}

Twist twist_of(const ArmPlace& place, const JointNumbers& rates_rad_per_s) noexcept {
  Column3 linear = Column3::Zero(), angular = Column3::Zero();
  for (std::size_t k = 0; k < place.joint_count; ++k) {
    const JacobianColumn column = jacobian_column(place, k);
    linear += rates_rad_per_s[k] * column.linear;
    angular += rates_rad_per_s[k] * column.angular;
  }
  return {linear.cast<Real>(), angular.cast<Real>()};
}

Pose pose_of(const ArmPlace& place) noexcept {
  const Eigen::Quaternion<double, Eigen::DontAlign> turn(place.turn_dh);
  return {place.tip.cast<Real>(), turn.normalized().cast<Real>()};
}

JointNumbers lever_bounds(const ArmModel& model) noexcept {
  JointNumbers bounds{};
  double length_m = 0;
  for (std::size_t k = model.joint_count; k-- > 0;) {
    const bool last = k + 1 == model.joint_count;
    const Column3& next = last ? model.tip_b : model.joints[k + 1].point_b;
    length_m += (next - model.joints[k].point_b).norm();
    bounds[k] = length_m;
  }
  return bounds;
}

}  // namespace haptic::tools
