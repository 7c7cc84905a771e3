// SPDX-License-Identifier: Apache-2.0
#include "rt_core/base/workspace_map.hpp"

#include <cmath>

namespace haptic {
namespace {

constexpr Real kSmallestScale = 1.0e-6_r, kLargestScale = 1.0e6_r;
constexpr Real kRotationTolerance = 1.0e-6_r;

bool is_unit(const Quat& q) noexcept {
  return std::abs(std::sqrt(q.squaredNorm()) - 1.0_r) <= kRotationTolerance;  // false for NaN
}

}  // namespace

bool is_usable(const WorkspaceMap& map) noexcept {
  return map.scale >= kSmallestScale && map.scale <= kLargestScale && is_unit(map.q_wd) &&
         is_unit(map.q_ha) && is_finite(map.offset_w) && is_finite(map.grip_a) &&
         is_finite(map.handle_offset_h);
}

Pose mesh_pose(const WorkspaceMap& map, const Pose& pose_dh) noexcept {
  Pose pose_wa;
  pose_wa.q_wa = (map.q_wd * pose_dh.q_wa * map.q_ha).normalized();
  const Vec3 x0_w = map.offset_w + map.q_wd.toRotationMatrix() * (map.scale * pose_dh.p_wa);
  pose_wa.p_wa = x0_w - pose_wa.q_wa.toRotationMatrix() * map.grip_a;
  return pose_wa;
}

Pose handle_pose(const WorkspaceMap& map, const Pose& pose_wa) noexcept {
  Pose pose_dh;
  const Quat q_dw = map.q_wd.conjugate();
  pose_dh.q_wa = (q_dw * pose_wa.q_wa * map.q_ha.conjugate()).normalized();
  const Vec3 x0_w = pose_wa.p_wa + pose_wa.q_wa.toRotationMatrix() * map.grip_a;
  pose_dh.p_wa = q_dw.toRotationMatrix() * (x0_w - map.offset_w) / map.scale;
  return pose_dh;
}

Twist scene_twist(const WorkspaceMap& map, const Twist& twist_d) noexcept {
  const Mat3 r_wd = map.q_wd.toRotationMatrix();
  return {map.scale * (r_wd * twist_d.linear_w), r_wd * twist_d.angular_w};
}

Vec3 handle_arm(const WorkspaceMap& map, const Quat& q_dh) noexcept {
  if (map.handle_offset_h == Vec3::Zero()) return Vec3::Zero();
  return q_dh.normalized().toRotationMatrix() * map.handle_offset_h;
}

Pose at_handle_point(const Pose& sensed_dh, const Vec3& arm_d) noexcept {
  if (arm_d == Vec3::Zero()) return sensed_dh;
  return {sensed_dh.p_wa + arm_d, sensed_dh.q_wa};
}

Twist at_handle_point(const Twist& sensed_d, const Vec3& arm_d) noexcept {
  if (arm_d == Vec3::Zero()) return sensed_d;
  return {sensed_d.linear_w + sensed_d.angular_w.cross(arm_d), sensed_d.angular_w};
}

Wrench about_sensed_point(const Wrench& handle_d, const Vec3& arm_d) noexcept {
  if (arm_d == Vec3::Zero()) return handle_d;
  return {handle_d.force_w, handle_d.torque_w + arm_d.cross(handle_d.force_w)};
}

Wrench about_handle_point(const Wrench& sensed_d, const Vec3& arm_d) noexcept {
  if (arm_d == Vec3::Zero()) return sensed_d;
  return {sensed_d.force_w, sensed_d.torque_w - arm_d.cross(sensed_d.force_w)};
}

// F_d . v_d = F_w . v_w with v_w = scale r_wd v_d, hence the scale on the force.
Wrench device_wrench(const WorkspaceMap& map, const Wrench& wrench_w) noexcept {
  const Mat3 r_dw = map.q_wd.toRotationMatrix().transpose();
  return {map.scale * (r_dw * wrench_w.force_w), r_dw * wrench_w.torque_w};
}

Wrench scene_wrench(const WorkspaceMap& map, const Wrench& wrench_d) noexcept {
  const Mat3 r_wd = map.q_wd.toRotationMatrix();
  return {r_wd * wrench_d.force_w / map.scale, r_wd * wrench_d.torque_w};
}

}  // namespace haptic
