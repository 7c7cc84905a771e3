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

Real potential_j(const Spring& spring, const PoseError& error) noexcept {
  return (spring.k_t_n_per_m * error.translation_m.squaredNorm() +
          spring.k_r_nm_per_rad * error.rotation_rad.squaredNorm()) /
         2;
}

Wrench spring_wrench(const Spring& spring, const PoseError& error) noexcept {
  return {-spring.k_t_n_per_m * error.translation_m, -spring.k_r_nm_per_rad * error.rotation_rad};
}

bool limit_goal(const AnchorLimits& limits, const GripPose& proxy, GripPose& goal,
                PoseError& error) noexcept {
  const bool fixed = kSceneTraits.is_fixed(limits.never_turns);
  error = fixed ? place_error(goal, proxy) : pose_error(goal, proxy);
  bool changed = false;
  const Real turn = fixed ? 0 : std::sqrt(error.rotation_rad.squaredNorm());
  if (turn > limits.max_rotation_rad) {
    error.rotation_rad *= limits.max_rotation_rad / turn;
    const GripPose turned = moved(proxy, Vec3::Zero(), error.rotation_rad);
    goal.q_wa = turned.q_wa;
    goal.r_wa = turned.r_wa;
    changed = true;
  }
  const Real distance = std::sqrt(error.translation_m.squaredNorm());
  if (limits.max_translation_m > 0 && distance > limits.max_translation_m) {
    error.translation_m *= limits.max_translation_m / distance;
    goal.x0_w = proxy.x0_w + error.translation_m;
    changed = true;
  }
  return changed;
}

}  // namespace haptic
