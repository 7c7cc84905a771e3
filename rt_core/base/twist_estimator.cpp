// SPDX-License-Identifier: Apache-2.0
// How the window is found in one pass. Let y_n be the way from the sample n intervals ago to the
// newest one and T_n its time. The line of slope v through the newest sample passes within the
// tolerance e of sample i exactly when (y_i - e) / T_i <= v <= (y_i + e) / T_i, per axis. The slope
// y_n / T_n is therefore tested against the intersection of the intervals of all i < n, which grows
// by one interval a step: 31 tests where trying every window from scratch takes 465. Once the
// intersection is empty no longer window can pass.
// The tolerance is one step: both ends of the line and the sample between them lie within half a
// step of the truth, so that a motion at constant velocity is never cut short.

#include "rt_core/base/twist_estimator.hpp"

#include <cmath>

#include "rt_core/base/rotation.hpp"
#include "rt_core/base/stamp.hpp"

namespace haptic {
namespace {

constexpr std::uint32_t kRingMask = kTwistSamples - 1;
static_assert((kTwistSamples & kRingMask) == 0, "the ring wraps by a mask");

// Slopes that every sample of the window so far agrees with.
struct SlopeBounds {
  Vec3 low = Vec3::Constant(-std::numeric_limits<Real>::max());
  Vec3 high = Vec3::Constant(std::numeric_limits<Real>::max());

  bool hold(const Vec3& slope) const noexcept {
    bool inside = true;
    for (int axis = 0; axis < 3; ++axis) {
      inside = inside && slope[axis] >= low[axis] && slope[axis] <= high[axis];
    }
    return inside;
  }
  // False when no slope is left.
  bool narrow(const Vec3& slope, Real slack) noexcept {
    bool any = true;
    for (int axis = 0; axis < 3; ++axis) {
      if (slope[axis] - slack > low[axis]) low[axis] = slope[axis] - slack;
      if (slope[axis] + slack < high[axis]) high[axis] = slope[axis] + slack;
      any = any && low[axis] <= high[axis];
    }
    return any;
  }
};

}  // namespace

TwistEstimator::TwistEstimator(const TwistWindow& window) noexcept {
  window_.step_m = non_negative(window.step_m);
  window_.step_rad = non_negative(window.step_rad);
  window_.min_window_s = non_negative(window.min_window_s);
  window_.max_window_s = non_negative(window.max_window_s);
}

void TwistEstimator::reset() noexcept {
  newest_ = 0;
  count_ = 0;
  refusals_ = 0;
  last_ = TwistEstimate{};
}

TwistEstimate TwistEstimator::update(const TwistSample& sample) noexcept {
  return take<true>(sample);
}

TwistEstimate TwistEstimator::update_place(const TwistSample& sample) noexcept {
  return take<false>(sample);
}

template <bool kTurns>
TwistEstimate TwistEstimator::take(const TwistSample& sample) noexcept {
  const bool sensed = sample.sensed && is_finite(sample.sensed_w);
  const bool pose_good = is_finite(sample.grip_w) && is_orientation(sample.q_wa);
  const bool newer = count_ == 0 || sample.stamp_ns > ring_[newest_].stamp_ns;
  if (pose_good && newer) {
    refusals_ = 0;
    push(sample);
    last_ = estimate<kTurns>();
  } else if (pose_good && refusals_ >= kMaxKeptTwists) {
    reset();
    push(sample);
  } else {
    // Bounded also for poses that are never finite: their twist does not stand for ever either.
    if (refusals_ < kMaxKeptTwists) {
      ++refusals_;
    } else {
      last_ = TwistEstimate{};
    }
    last_.kept = true;
  }
  TwistEstimate result = last_;
  if (sensed) {
    // The history goes on beneath it: a device that stops sensing leaves no gap.
    result = TwistEstimate{};
    result.twist_w = sample.sensed_w;
    if (!kTurns) result.twist_w.angular_w = Vec3::Zero();
    result.valid = true;
    result.sensed = true;
  }
  return result;
}

void TwistEstimator::push(const TwistSample& sample) noexcept {
  newest_ = (newest_ + 1U) & kRingMask;
  ring_[newest_] = {sample.stamp_ns, sample.grip_w, sample.q_wa};
  if (count_ < kTwistSamples) ++count_;
}

const TwistEstimator::Kept& TwistEstimator::sample_before(std::uint32_t intervals) const noexcept {
  return ring_[(newest_ - intervals) & kRingMask];
}

template <bool kAngular>
TwistEstimator::Slope TwistEstimator::slope(Real step) const noexcept {
  const Kept& now = sample_before(0);
  Slope best;
  SlopeBounds bounds;
  bool cut_by_turn = false;
  for (std::uint32_t n = 1; n < count_; ++n) {
    const Kept& then = sample_before(n);
    const Real span_s = seconds_between(then.stamp_ns, now.stamp_ns);
    const bool first = n == 1;
    if (!first && span_s > window_.max_window_s && best.span_s >= window_.min_window_s) break;
    const Vec3 way =
        kAngular ? so3_log(now.q_wa * then.q_wa.conjugate()) : now.grip_w - then.grip_w;
    cut_by_turn = kAngular && !first && way.squaredNorm() > kMaxWindowTurn_rad * kMaxWindowTurn_rad;
    if (cut_by_turn) break;
    const Vec3 per_s = way / span_s;
    // Below the shortest window nothing is tested: its samples only narrow what the longer ones may
    // be.
    const bool required = best.span_s < window_.min_window_s || first;
    if (required || bounds.hold(per_s)) best = {per_s, span_s};
    if (!bounds.narrow(per_s, step / span_s) || !(step > 0.0_r)) {
      if (best.span_s >= window_.min_window_s) break;
    }
  }
  const bool spans = best.span_s >= window_.min_window_s || count_ == kTwistSamples || cut_by_turn;
  return spans && is_finite(best.per_s) ? best : Slope{};
}

template <bool kTurns>
TwistEstimate TwistEstimator::estimate() const noexcept {
  TwistEstimate result;
  if (count_ < 2) return result;
  const Slope linear = slope<false>(window_.step_m);
  Slope angular;
  if constexpr (kTurns) angular = slope<true>(window_.step_rad);
  result.valid = linear.span_s > 0.0_r && (!kTurns || angular.span_s > 0.0_r);
  if (!result.valid) return result;
  result.twist_w = {linear.per_s, angular.per_s};
  result.linear_window_s = linear.span_s;
  result.linear_noise_m_per_s = window_.step_m / linear.span_s;
  result.linear_delay_s = 0.5_r * linear.span_s;
  if (!kTurns) return result;
  result.angular_window_s = angular.span_s;
  result.angular_noise_rad_per_s = window_.step_rad / angular.span_s;
  result.angular_delay_s = 0.5_r * angular.span_s;
  return result;
}

}  // namespace haptic
