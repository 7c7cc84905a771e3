// SPDX-License-Identifier: Apache-2.0
#pragma once
/// From the device's handle to the part in the scene and back: scale, rotation, offset. Clutching
/// is the core's (HapticCore holds the goal and goes on from it); this map is fixed.
///
/// The handle point h_d stands for the grip point: x0_w = offset_w + r_wd (scale h_d), and
/// q_wa = q_wd q_dh q_ha. Power is the same on both sides in translation, so F_d = scale r_wd^T
/// F_w; turns are not scaled, so tau_d = r_wd^T tau_w about the handle point.
///
/// The device senses its pose, and exerts its wrench, at another point of the handle: from there to
/// the handle point (the tip of a tool) is handle_offset_h. The functions with `arm_d` go from one
/// of the two points to the other; all others are about the handle point.

#include "rt_core/base/pose.hpp"

namespace haptic {

struct WorkspaceMap {
  Real scale = 1.0_r;                   ///< metres in the scene per metre at the device, > 0
  Quat q_wd = Quat::Identity();         ///< device axes to scene axes
  Quat q_ha = Quat::Identity();         ///< A's mesh axes to handle axes
  Vec3 offset_w = Vec3::Zero();         ///< where the device's origin is in the scene [m]
  Vec3 grip_a = Vec3::Zero();           ///< grip point in A's mesh frame [m]
  Vec3 handle_offset_h = Vec3::Zero();  ///< handle point about the sensed point [m]
};

/// Finite, scale in [1e-6, 1e6], both quaternions unit to 1e-6.
[[nodiscard]] bool is_usable(const WorkspaceMap& map) noexcept;

/// A's mesh frame in W for a handle pose in D (p_wa, q_wa of `pose_dh` are p_dh, q_dh).
[[nodiscard]] Pose mesh_pose(const WorkspaceMap& map, const Pose& pose_dh) noexcept;
/// The handle pose at which A's mesh frame is at `pose_wa`: inverse of mesh_pose.
[[nodiscard]] Pose handle_pose(const WorkspaceMap& map, const Pose& pose_wa) noexcept;
/// Velocity of the grip point in W for the handle's in D.
[[nodiscard]] Twist scene_twist(const WorkspaceMap& map, const Twist& twist_d) noexcept;
/// From the sensed point to the handle point, in D, at an orientation of the handle.
[[nodiscard]] Vec3 handle_arm(const WorkspaceMap& map, const Quat& q_dh) noexcept;
/// Pose and twist of the handle point for those of the sensed point; zero arm: the same bits.
[[nodiscard]] Pose at_handle_point(const Pose& sensed_dh, const Vec3& arm_d) noexcept;
[[nodiscard]] Twist at_handle_point(const Twist& sensed_d, const Vec3& arm_d) noexcept;
/// A wrench about the handle point as one about the sensed point, and the inverse.
[[nodiscard]] Wrench about_sensed_point(const Wrench& handle_d, const Vec3& arm_d) noexcept;
[[nodiscard]] Wrench about_handle_point(const Wrench& sensed_d, const Vec3& arm_d) noexcept;

/// What the handle must feel for a wrench about the grip point, and the inverse.
[[nodiscard]] Wrench device_wrench(const WorkspaceMap& map, const Wrench& wrench_w) noexcept;
[[nodiscard]] Wrench scene_wrench(const WorkspaceMap& map, const Wrench& wrench_d) noexcept;

}  // namespace haptic
