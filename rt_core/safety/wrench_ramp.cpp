// SPDX-License-Identifier: Apache-2.0
#include "rt_core/safety/wrench_ramp.hpp"

#include <cmath>

#include "rt_core/base/stamp.hpp"

namespace haptic {
namespace {

Real at_least_zero(Real value) noexcept {
  return std::isfinite(value) && value > 0.0_r ? value : 0.0_r;
}

constexpr Real kAtOnce_per_s = std::numeric_limits<Real>::max();

}  // namespace

WrenchRamp::WrenchRamp(const WrenchRampLimits& limits) noexcept {
  limits_.slew_n_per_s = at_least_zero(limits.slew_n_per_s);
  limits_.slew_nm_per_s = at_least_zero(limits.slew_nm_per_s);
  limits_.ramp_out_s = at_least_zero(limits.ramp_out_s);
  const Real ramp_in_s = at_least_zero(limits.ramp_in_s);
  limits_.ramp_in_s = ramp_in_s > kMinRampIn_s ? ramp_in_s : kMinRampIn_s;
}

void WrenchRamp::reset(bool in) noexcept {
  state_ = in ? RampState::kIn : RampState::kOut;
  wanted_ = in;
  stamped_ = false;
  gain_ = in ? 1.0_r : 0.0_r;
  wrench_w_ = Wrench{};
}

Real WrenchRamp::elapsed_s(std::int64_t stamp_ns) noexcept {
  const Real elapsed = stamped_ ? seconds_between(stamp_ns_, stamp_ns) : 0.0_r;
  stamped_ = true;
  stamp_ns_ = stamp_ns;
  return elapsed < kLongestRampTick_s ? elapsed : kLongestRampTick_s;
}

// Change of the gain per second that keeps force and torque of `wrench_w_` within the slew limits.
Real WrenchRamp::slew_rate_per_s(Real fastest_per_s) const noexcept {
  Real rate = fastest_per_s;
  const Real force_n = robust_length(wrench_w_.force_w);
  const Real torque_nm = robust_length(wrench_w_.torque_w);
  if (limits_.slew_n_per_s > 0.0_r && force_n * rate > limits_.slew_n_per_s) {
    rate = limits_.slew_n_per_s / force_n;
  }
  if (limits_.slew_nm_per_s > 0.0_r && torque_nm * rate > limits_.slew_nm_per_s) {
    rate = limits_.slew_nm_per_s / torque_nm;
  }
  return rate;
}

RampedWrench WrenchRamp::update(std::int64_t stamp_ns, const Wrench& wrench_w) noexcept {
  const Real elapsed = elapsed_s(stamp_ns);
  const bool engaged = state_ == RampState::kIn || state_ == RampState::kRampingIn;
  if (!wanted_ && engaged) state_ = RampState::kRampingOut;
  if (wanted_ && state_ == RampState::kOut) state_ = RampState::kRampingIn;
  if (state_ != RampState::kRampingOut && is_finite(wrench_w)) wrench_w_ = wrench_w;

  if (state_ == RampState::kRampingOut) {
    const bool by_slew = limits_.slew_n_per_s > 0.0_r && limits_.slew_nm_per_s > 0.0_r;
    const bool at_once = by_slew || !(limits_.ramp_out_s > 0.0_r);
    const Real fall =
        slew_rate_per_s(at_once ? kAtOnce_per_s : 1.0_r / limits_.ramp_out_s) * elapsed;
    gain_ = fall < gain_ ? gain_ - fall : 0.0_r;
    if (gain_ == 0.0_r) state_ = RampState::kOut;
  } else if (state_ == RampState::kRampingIn) {
    const Real rise = slew_rate_per_s(1.0_r / limits_.ramp_in_s) * elapsed;
    gain_ = gain_ + rise < 1.0_r ? gain_ + rise : 1.0_r;
    if (gain_ == 1.0_r) state_ = RampState::kIn;
  }
  RampedWrench result;
  result.gain = gain_;
  result.state = state_;
  if (gain_ > 0.0_r) result.wrench_w = {gain_ * wrench_w_.force_w, gain_ * wrench_w_.torque_w};
  return result;
}

}  // namespace haptic
