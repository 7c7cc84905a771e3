// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The spring between proxy and goal: error, energy and wrench (Ortega, Redon, Coquillart, IEEE
/// TVCG 13(3), 2007, for the god-object in SE(3); here with a stiffness of rotation of its own).

#include "rt_core/base/pose.hpp"

namespace haptic {

/// Where the goal lies, seen from the proxy: g(p) = (x_d - x, log(R_d R^T)), W axes.
struct PoseError {
  Vec3 translation_m = Vec3::Zero();
  Vec3 rotation_rad = Vec3::Zero();
};

/// Stiffness K = diag(k_t, k_t, k_t, k_r, k_r, k_r), k_r = k_t L^2: L is the radius at which a
/// rotation counts like a displacement.
struct Spring {
  Real k_t_n_per_m = 0;
  Real k_r_nm_per_rad = 0;
  Real length_m = 0;  ///< L
};

[[nodiscard]] PoseError pose_error(const GripPose& goal, const GripPose& proxy) noexcept;

/// The same of two poses with one orientation: the rotation is exactly zero.
[[nodiscard]] inline PoseError place_error(const GripPose& goal, const GripPose& proxy) noexcept {
  return {goal.x0_w - proxy.x0_w, Vec3::Zero()};
}

/// p (+) delta = (x + dx, exp(dtheta) R); the quaternion is normalised. |dtheta| <= 1e4.
[[nodiscard]] GripPose moved(const GripPose& pose, const Vec3& dx_m,
                             const Vec3& dtheta_rad) noexcept;

/// V = 1/2 g^T K g. [J]
[[nodiscard]] Real potential_j(const Spring& spring, const PoseError& error) noexcept;

/// Wrench on the hand about x_0^A: F = -k_t g_t, tau = -k_r g_r, exactly -dV/dq_d.
[[nodiscard]] Wrench spring_wrench(const Spring& spring, const PoseError& error) noexcept;

/// What holds the goal back where the pull would become too large: an offset that follows.
struct AnchorLimits {
  Real max_rotation_rad = 1;   ///< theta_sat
  Real max_translation_m = 0;  ///< 0: none
  bool never_turns = false;    ///< goal and proxy have one orientation
};

/// The goal nearest to `goal` whose error against `proxy` is within the limits; `error` is that of
/// the result. False: it was within them already and nothing was changed.
[[nodiscard]] bool limit_goal(const AnchorLimits& limits, const GripPose& proxy, GripPose& goal,
                              PoseError& error) noexcept;

}  // namespace haptic
