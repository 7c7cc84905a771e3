// SPDX-License-Identifier: Apache-2.0
#include "rt_core/base/encoder_play.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/base/rotation.hpp"

namespace haptic {
namespace {

Real usable_step(Real step) noexcept { return std::isfinite(step) && step > 0.0_r ? step : 0.0_r; }

/// What of `v` is beyond `slack` per axis: the part that takes the play along.
Vec3 beyond_play(const Vec3& v, Real slack) noexcept {
  Vec3 out;
  for (int axis = 0; axis < 3; ++axis) out[axis] = v[axis] - std::clamp(v[axis], -slack, slack);
  return out;
}

}  // namespace

EncoderPlay::EncoderPlay(Real step_m, Real step_rad) noexcept
    : step_m_(usable_step(step_m)), step_rad_(usable_step(step_rad)) {}

void EncoderPlay::reset() noexcept { started_ = false; }

PlayedPose EncoderPlay::update(const Vec3& grip_w, const Quat& q_wa) noexcept {
  return take<true>(grip_w, q_wa);
}

PlayedPose EncoderPlay::update_place(const Vec3& grip_w, const Quat& q_wa) noexcept {
  return take<false>(grip_w, q_wa);
}

template <bool kTurns>
PlayedPose EncoderPlay::take(const Vec3& grip_w, const Quat& q_wa) noexcept {
  PlayedPose result;
  const bool usable = is_finite(grip_w) && (!kTurns || is_orientation(q_wa));
  if (usable && !started_) {
    grip_w_ = grip_w;
    q_wa_ = q_wa;
    started_ = true;
  } else if (usable) {
    const Vec3 off = grip_w - grip_w_;
    result.way_m = beyond_play(off, step_m_);
    result.ahead_m = off - result.way_m;
    // Without a step the sensed pose itself: a sum of ways would lose its last digits.
    grip_w_ = step_m_ > 0.0_r ? Vec3(grip_w_ + result.way_m) : grip_w;
    if constexpr (kTurns) {
      const Vec3 turned = so3_log(q_wa * q_wa_.conjugate());
      result.turn_rad = beyond_play(turned, step_rad_);
      result.ahead_rad = turned - result.turn_rad;
      if (!(step_rad_ > 0.0_r)) {
        q_wa_ = q_wa;
      } else if (!result.turn_rad.isZero(0)) {
        q_wa_ = (so3_exp(result.turn_rad) * q_wa_).normalized();
      }
    }
  }
  result.grip_w = grip_w_;
  result.q_wa = q_wa_;
  return result;
}

}  // namespace haptic
