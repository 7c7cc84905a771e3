// SPDX-License-Identifier: Apache-2.0
#include "rt_core/law/coupling.hpp"

#include <cmath>

#include "rt_core/base/rotation.hpp"
#include "rt_core/scene/scene_traits.hpp"

namespace haptic {

PoseError pose_error(const GripPose& goal, const GripPose& proxy) noexcept {
  return {goal.x0_w - proxy.x0_w, so3_log(goal.q_wa * proxy.q_wa.conjugate())};
}

GripPose moved(const GripPose& pose, const Vec3& dx_m, const Vec3& dtheta_rad) noexcept {
  GripPose result;
  result.x0_w = pose.x0_w + dx_m;
  if (!kSceneTraits.free_orientation || dtheta_rad.isZero(0)) {
    result.q_wa = pose.q_wa;
    result.r_wa = pose.r_wa;
    return result;
  }
  result.q_wa = (so3_exp(dtheta_rad) * pose.q_wa).normalized();
  result.r_wa = result.q_wa.toRotationMatrix();
  return result;
}

namespace {

Real length_of(const Vec3& v) noexcept { return std::sqrt(v.squaredNorm()); }

/// By what the stiffness falls where an error of this length is beyond `soft`.
Real share_of(Real length, Real soft) noexcept {
  return soft > 0 && length > soft ? soft / length : Real{1};
}

/// Huber's function over the stiffness.
Real soft_square(const Vec3& v, Real soft) noexcept {
  const Real square = v.squaredNorm();
  if (!(soft > 0) || square <= soft * soft) return square / 2;
  return soft * (std::sqrt(square) - soft / 2);
}

}  // namespace

Real potential_j(const Spring& spring, const PoseError& error) noexcept {
  return spring.k_t_n_per_m * soft_square(error.translation_m, spring.soft_translation_m) +
         spring.k_r_nm_per_rad * soft_square(error.rotation_rad, spring.soft_rotation_rad);
}

PoseError felt_error(const Spring& spring, const PoseError& error) noexcept {
  const Real t = share_of(length_of(error.translation_m), spring.soft_translation_m);
  const Real r = share_of(length_of(error.rotation_rad), spring.soft_rotation_rad);
  return {t * error.translation_m, r * error.rotation_rad};
}

Wrench spring_wrench(const Spring& spring, const PoseError& error) noexcept {
  const PoseError felt = felt_error(spring, error);
  return {-spring.k_t_n_per_m * felt.translation_m, -spring.k_r_nm_per_rad * felt.rotation_rad};
}

bool is_saturated(const Spring& spring, const PoseError& error) noexcept {
  return share_of(length_of(error.translation_m), spring.soft_translation_m) < 1 ||
         share_of(length_of(error.rotation_rad), spring.soft_rotation_rad) < 1;
}

Spring secant_spring(const Spring& spring, const PoseError& error) noexcept {
  const Real t = share_of(length_of(error.translation_m), spring.soft_translation_m);
  const Real r = share_of(length_of(error.rotation_rad), spring.soft_rotation_rad);
  if (!(t < 1) && !(r < 1)) return {spring.k_t_n_per_m, spring.k_r_nm_per_rad, spring.length_m};
  return {t * spring.k_t_n_per_m, r * spring.k_r_nm_per_rad, spring.length_m * std::sqrt(r / t)};
}

bool limit_turn(Real most_rad, const GripPose& proxy, GripPose& goal) noexcept {
  const Vec3 turn = so3_log(goal.q_wa * proxy.q_wa.conjugate());
  const Real angle = length_of(turn);
  if (!(angle > most_rad)) return false;
  const GripPose turned = moved(proxy, Vec3::Zero(), turn * (most_rad / angle));
  goal.q_wa = turned.q_wa;
  goal.r_wa = turned.r_wa;
  return true;
}

}  // namespace haptic
