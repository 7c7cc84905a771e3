// SPDX-License-Identifier: Apache-2.0
#include "rt_core/base/motion_envelope.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/base/rotation.hpp"

namespace haptic {
namespace {

constexpr Real kUnitTolerance = 1.0e-3_r;
/// A turn is brought this share short of its limit, so that rounding leaves it inside.
constexpr Real kShort = 1 - 64 * kRealEpsilon;

Vec3 turn_from(const Quat& from, const Quat& to) noexcept {
  return so3_log((to * from.conjugate()).normalized());
}

}  // namespace

bool is_usable(const MotionEnvelope& e) noexcept {
  bool usable = is_finite(e.centre_w) && is_finite(e.half_extent_m) &&
                (e.half_extent_m.array() >= 0.0_r).all() && std::isfinite(e.max_angle_rad) &&
                e.max_angle_rad >= 0.0_r;
  if (e.limits_turn()) {
    // Comparisons with NaN are false.
    const Real n = std::sqrt(e.q_wa.squaredNorm());
    usable = usable && n >= 1.0_r - kUnitTolerance && n <= 1.0_r + kUnitTolerance;
  }
  return usable;
}

bool hold_place(const MotionEnvelope& e, GripPose& pose) noexcept {
  bool changed = false;
  for (int k = 0; k < 3; ++k) {
    if (e.half_extent_m[k] == 0.0_r) continue;
    const Real held = std::clamp(pose.x0_w[k], e.centre_w[k] - e.half_extent_m[k],
                                 e.centre_w[k] + e.half_extent_m[k]);
    changed = changed || held != pose.x0_w[k];
    pose.x0_w[k] = held;
  }
  return changed;
}

bool hold_inside(const MotionEnvelope& e, GripPose& pose) noexcept {
  const bool changed = hold_place(e, pose);
  if (!e.limits_turn()) return changed;
  const Vec3 turn = turn_from(e.q_wa, pose.q_wa);
  const Real angle = robust_length(turn);
  if (angle <= e.max_angle_rad) return changed;
  pose.q_wa = (so3_exp(turn * (kShort * e.max_angle_rad / angle)) * e.q_wa).normalized();
  pose.r_wa = pose.q_wa.toRotationMatrix();
  return true;
}

std::uint32_t EnvelopeWatch::update_place(const MotionEnvelope& e, const Vec3& x0_w) noexcept {
  const Vec3 next_w = has_last_ ? Vec3(x0_w + (x0_w - last_x0_w_)) : x0_w;
  std::uint32_t outside = 0;
  for (int k = 0; k < 3; ++k) {
    if (e.half_extent_m[k] == 0.0_r) continue;
    const Real farthest =
        std::max(std::abs(x0_w[k] - e.centre_w[k]), std::abs(next_w[k] - e.centre_w[k]));
    if (!(farthest <= e.half_extent_m[k])) outside |= kOutsideWorkspace;
  }
  last_x0_w_ = x0_w;
  has_last_ = true;
  return outside;
}

std::uint32_t EnvelopeWatch::update(const MotionEnvelope& e, const Vec3& x0_w,
                                    const Quat& q_wa) noexcept {
  const bool has_angle = has_last_;
  std::uint32_t outside = update_place(e, x0_w);
  Real angle_rad = 0;
  if (e.limits_turn()) {
    angle_rad = robust_length(turn_from(e.q_wa, q_wa));
    const Real rise_rad = has_angle ? std::max(angle_rad - last_angle_rad_, 0.0_r) : 0.0_r;
    if (!(angle_rad + rise_rad <= e.max_angle_rad)) outside |= kOutsideOrientation;
  }
  last_angle_rad_ = angle_rad;
  return outside;
}

}  // namespace haptic
