// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A serial arm of turning joints: where its handle is, how joint rates move it, which joint
/// torques a wrench at the handle is, and which its own weight is. No heap.
///
/// Frame B is the arm's base link with all joints at 0; every axis, point and centre of mass is
/// stored there, in that pose. T(q) = E_1(q_1) ... E_n(q_n) T(0), E_k the turn about the axis of
/// joint k (product of exponentials; Lynch and Park, Modern Robotics, section 4.1).
/// Frame D is the device's: `turn_db` and `origin_d` place B in it, and gravity is along -z of D.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>

#include "rt_core/base/pose.hpp"

namespace haptic::tools {

inline constexpr std::size_t kMaxJoints = 8;

/// One number a joint, from the base to the handle.
using JointNumbers = std::array<double, kMaxJoints>;
/// In double for every scalar of the core: kinematics of a metre need residuals of a micrometre.
using Column3 = Eigen::Matrix<double, 3, 1, Eigen::DontAlign>;
using Square3 = Eigen::Matrix<double, 3, 3, Eigen::DontAlign>;

/// All that turns with a joint and with none nearer to the handle, as one mass.
struct ArmMass {
  double mass_kg = 0;
  Column3 centre_b = Column3::Zero();
};

struct ArmJoint {
  Column3 axis_b = Column3::UnitX();    ///< unit
  Column3 point_b = Column3::Zero();    ///< on the axis [m]
  bool limited = false;                 ///< false: turns without end
  double lower_rad = 0, upper_rad = 0;  ///< where limited
  ArmMass carried;
};

struct ArmModel {
  std::size_t joint_count = 0;  ///< 1 to kMaxJoints
  std::array<ArmJoint, kMaxJoints> joints;
  Column3 tip_b = Column3::Zero();        ///< handle point
  Square3 turn_bh = Square3::Identity();  ///< maps handle axes to B
  Square3 turn_db = Square3::Identity();  ///< maps B to D
  Column3 origin_d = Column3::Zero();     ///< of B in D [m]
};

/// The arm at some joint angles, in D.
struct ArmPlace {
  std::size_t joint_count = 0;
  Column3 tip = Column3::Zero();
  Square3 turn_dh = Square3::Identity();
  std::array<Column3, kMaxJoints> axis, point;
  std::array<ArmMass, kMaxJoints> carried;  ///< `centre_b` is in D here
};

/// Cost: linear in the joints.
[[nodiscard]] ArmPlace place_of(const ArmModel& model, const JointNumbers& angles_rad) noexcept;

/// Column k of the geometric Jacobian: velocity of the handle point [m/rad] and turn [1].
struct JacobianColumn {
  Column3 linear = Column3::Zero(), angular = Column3::Zero();
};
[[nodiscard]] JacobianColumn jacobian_column(const ArmPlace& place, std::size_t joint) noexcept;

/// Force at the handle point [N] and torque [N m] to joint torques [N m]: J^T w.
[[nodiscard]] JointNumbers torques_of(const ArmPlace& place, const Column3& force_d,
                                      const Column3& torque_d) noexcept;

/// Joint torques that hold the arm's own weight [N m].
[[nodiscard]] JointNumbers weight_torques(const ArmPlace& place) noexcept;

/// Twist of the handle point, in D axes, for joint rates [rad/s].
[[nodiscard]] Twist twist_of(const ArmPlace& place, const JointNumbers& rates_rad_per_s) noexcept;

/// In D; the quaternion is unit.
[[nodiscard]] Pose pose_of(const ArmPlace& place) noexcept;

/// The farthest that the handle point can be from the axis of joint k, in any pose [m]: the sum of
/// the distances from joint to joint.
[[nodiscard]] JointNumbers lever_bounds(const ArmModel& model) noexcept;

inline constexpr double kGravity_m_per_s2 = 9.80665;

}  // namespace haptic::tools
