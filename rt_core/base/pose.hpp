// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Pose, twist and wrench: frames and units once for the whole project.
/// Frames: W workspace (fixed), A manipulated object, B obstacle. `r_wa` maps A-vectors to W.
/// SI units: m, rad, s, N, N m. Quaternions: Hamilton, unit, stored x y z w.

#include <cmath>

#include "rt_core/base/scalar.hpp"

namespace haptic {

/// Pose of frame A in frame W: a point p_a of A is at p_wa + q_wa * p_a.
struct Pose {
  Vec3 p_wa = Vec3::Zero();      ///< origin of A in W [m]
  Quat q_wa = Quat::Identity();  ///< orientation of A in W
};

/// Pose of A as the formulas use it: grip point and orientation, the latter in both forms.
struct GripPose {
  Vec3 x0_w = Vec3::Zero();  ///< grip point x_0^A in W [m]
  Quat q_wa = Quat::Identity();
  Mat3 r_wa = Mat3::Identity();
};

/// Velocity of A in W axes, at the grip point.
struct Twist {
  Vec3 linear_w = Vec3::Zero();   ///< [m/s]
  Vec3 angular_w = Vec3::Zero();  ///< [rad/s]
};

/// Force and torque on the hand, in W axes; torque about the grip point x_0^A.
struct Wrench {
  Vec3 force_w = Vec3::Zero();   ///< [N]
  Vec3 torque_w = Vec3::Zero();  ///< [N m]
};

[[nodiscard]] inline bool is_finite(const Vec3& v) noexcept {
  return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}
[[nodiscard]] inline bool is_finite(const Twist& t) noexcept {
  return is_finite(t.linear_w) && is_finite(t.angular_w);
}
[[nodiscard]] inline bool is_finite(const Wrench& w) noexcept {
  return is_finite(w.force_w) && is_finite(w.torque_w);
}
/// |v| of any finite vector: its squares may overflow or vanish.
[[nodiscard]] inline Real robust_length(const Vec3& v) noexcept {
  const Real largest = v.cwiseAbs().maxCoeff();
  return largest > 0.0_r ? largest * (v / largest).norm() : 0.0_r;
}
/// True where `q`, of any length, stands for a rotation: finite and not zero.
[[nodiscard]] inline bool is_orientation(const Quat& q) noexcept {
  const Real square = q.squaredNorm();
  return std::isfinite(square) && square > 0.0_r;
}

}  // namespace haptic
