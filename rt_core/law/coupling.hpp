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
/// rotation counts like a displacement. Force and torque grow with the error up to a limit and stay
/// there (Huber's function): the pull has a largest value, and still it is an energy's gradient, so
/// that nothing is forgotten when the error falls again.
struct Spring {
  Real k_t_n_per_m = 0;
  Real k_r_nm_per_rad = 0;
  Real length_m = 0;  ///< L
  /// Errors from which on the force and the torque no longer grow; 0: no limit.
  Real soft_translation_m = 0;
  Real soft_rotation_rad = 0;
};

[[nodiscard]] PoseError pose_error(const GripPose& goal, const GripPose& proxy) noexcept;

/// The same of two poses with one orientation: the rotation is exactly zero.
[[nodiscard]] inline PoseError place_error(const GripPose& goal, const GripPose& proxy) noexcept {
  return {goal.x0_w - proxy.x0_w, Vec3::Zero()};
}

/// p (+) delta = (x + dx, exp(dtheta) R); the quaternion is normalised. |dtheta| <= 1e4.
[[nodiscard]] GripPose moved(const GripPose& pose, const Vec3& dx_m,
                             const Vec3& dtheta_rad) noexcept;

/// V = V_t + V_r, V_t = 1/2 k_t |g_t|^2 up to |g_t| = s, k_t s (|g_t| - s / 2) beyond; V_r alike.
/// [J]
[[nodiscard]] Real potential_j(const Spring& spring, const PoseError& error) noexcept;

/// The error that the pull is proportional to: each part cut to the length where it stops growing.
[[nodiscard]] PoseError felt_error(const Spring& spring, const PoseError& error) noexcept;

/// Wrench on the hand about x_0^A: F = -k_t g_t, tau = -k_r g_r of the felt error, exactly
/// -dV/dq_d.
[[nodiscard]] Wrench spring_wrench(const Spring& spring, const PoseError& error) noexcept;

/// True if force or torque has reached its limit.
[[nodiscard]] bool is_saturated(const Spring& spring, const PoseError& error) noexcept;

/// The spring without limits that gives the same wrench at `error` and whose energy rises no less
/// than V to any other error: its stiffness is the secant's, |dV| / |g|. Where its energy falls, V
/// falls as far or farther.
[[nodiscard]] Spring secant_spring(const Spring& spring, const PoseError& error) noexcept;

/// Turns `goal` back to `most_rad` from `proxy` about the same axis where it is farther, so that
/// the shorter way between them stays the same. False: it was not and nothing was changed.
[[nodiscard]] bool limit_turn(Real most_rad, const GripPose& proxy, GripPose& goal) noexcept;

}  // namespace haptic
