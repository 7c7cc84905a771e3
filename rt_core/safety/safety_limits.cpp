// SPDX-License-Identifier: Apache-2.0
#include "rt_core/safety/safety_limits.hpp"

#include "rt_core/base/stamp.hpp"
#include "rt_core/safety/wrench_ramp.hpp"

namespace haptic {
namespace {

// Beyond these a number is a slip of units, not a hand-held device.
constexpr Real kLargestForce_n = 1.0e3_r, kLargestTorque_nm = 1.0e2_r;
constexpr Real kLargestSlew_n_per_s = 1.0e6_r, kLargestSlew_nm_per_s = 1.0e5_r;
constexpr Real kLongestRampIn_s = 10.0_r;
constexpr Real kLargestSpeed_m_per_s = 1.0e3_r, kLargestTurn_rad_per_s = 1.0e5_r;
constexpr std::int64_t kShortestPeriod_ns = 10'000, kLongestPeriod_ns = 1'000'000'000;
constexpr std::uint32_t kMostLostPeriods = 1000;
constexpr Real kSlowestDecay = 1.0_r - kRealEpsilon;  // at 1 it would hold for ever

/// Of `value` in [low, high], where low is the tightest: below it, that; above, or NaN: otherwise.
Real at_least(Real value, Real low, Real high, Real otherwise) noexcept {
  if (value < low) return low;
  return value <= high ? value : otherwise;
}

/// Per axis, 0 is no limit of its own: what is none takes the norm's.
void keep_axes(Vec3& axes, Real largest) noexcept {
  for (int k = 0; k < 3; ++k) {
    if (!(axes[k] >= 0.0_r && axes[k] <= largest)) axes[k] = 0.0_r;
  }
}

/// A fade from `full` to `zero`; where they are not in order, from the lower one at once.
void keep_fade(Real& full, Real& zero, Real largest, Real full_otherwise,
               Real zero_otherwise) noexcept {
  full = at_least(full, 0.0_r, largest, full_otherwise);
  zero = at_least(zero, 0.0_r, largest, zero_otherwise);
  if (full > zero) full = zero;
}

Real smaller(Real one, Real other) noexcept { return one < other ? one : other; }

Vec3 smaller_axes(const Vec3& one, const Vec3& other) noexcept {
  Vec3 axes;
  for (int k = 0; k < 3; ++k) {
    const bool both = one[k] > 0.0_r && other[k] > 0.0_r;
    axes[k] = both ? smaller(one[k], other[k]) : one[k] + other[k];
  }
  return axes;
}

/// Time of a ramp from `largest`; none is reached where nothing may change.
Real ramp_s(Real largest, Real slew_per_s) noexcept {
  return slew_per_s > 0.0_r ? largest / slew_per_s : 0.0_r;
}

}  // namespace

SafetyLimits usable(const SafetyLimits& limits) noexcept {
  const SafetyLimits safe;
  SafetyLimits l = limits;
  l.max_force_n = at_least(l.max_force_n, 0.0_r, kLargestForce_n, safe.max_force_n);
  l.max_torque_nm = at_least(l.max_torque_nm, 0.0_r, kLargestTorque_nm, safe.max_torque_nm);
  keep_axes(l.max_axis_force_n, kLargestForce_n);
  keep_axes(l.max_axis_torque_nm, kLargestTorque_nm);
  l.slew_n_per_s = at_least(l.slew_n_per_s, 0.0_r, kLargestSlew_n_per_s, safe.slew_n_per_s);
  l.slew_nm_per_s = at_least(l.slew_nm_per_s, 0.0_r, kLargestSlew_nm_per_s, safe.slew_nm_per_s);
  // Of a time, the longest is the tightest.
  if (l.ramp_in_s > kLongestRampIn_s) l.ramp_in_s = kLongestRampIn_s;
  if (!(l.ramp_in_s >= kMinRampIn_s)) l.ramp_in_s = safe.ramp_in_s;
  l.driven_dof &= safe.driven_dof;
  keep_fade(l.full_speed_m_per_s, l.zero_speed_m_per_s, kLargestSpeed_m_per_s,
            safe.full_speed_m_per_s, safe.zero_speed_m_per_s);
  keep_fade(l.full_turn_rad_per_s, l.zero_turn_rad_per_s, kLargestTurn_rad_per_s,
            safe.full_turn_rad_per_s, safe.zero_turn_rad_per_s);
  if (l.period_ns < kShortestPeriod_ns || l.period_ns > kLongestPeriod_ns) {
    l.period_ns = safe.period_ns;
  }
  if (l.lost_periods > kMostLostPeriods) l.lost_periods = safe.lost_periods;
  if (l.held_periods > l.lost_periods) {
    l.held_periods = safe.held_periods < l.lost_periods ? safe.held_periods : l.lost_periods;
  }
  l.decay_per_period = at_least(l.decay_per_period, 0.0_r, kSlowestDecay, safe.decay_per_period);
  l.jump_speed_m_per_s =
      at_least(l.jump_speed_m_per_s, 0.0_r, kLargestSpeed_m_per_s, safe.jump_speed_m_per_s);
  l.jump_turn_rad_per_s =
      at_least(l.jump_turn_rad_per_s, 0.0_r, kLargestTurn_rad_per_s, safe.jump_turn_rad_per_s);
  return l;
}

SafetyLimits tighter(const SafetyLimits& own, const SafetyLimits& other) noexcept {
  SafetyLimits l = usable(own);
  const SafetyLimits o = usable(other);
  for (const auto number :
       {&SafetyLimits::max_force_n, &SafetyLimits::max_torque_nm, &SafetyLimits::slew_n_per_s,
        &SafetyLimits::slew_nm_per_s, &SafetyLimits::full_speed_m_per_s,
        &SafetyLimits::zero_speed_m_per_s, &SafetyLimits::full_turn_rad_per_s,
        &SafetyLimits::zero_turn_rad_per_s, &SafetyLimits::decay_per_period,
        &SafetyLimits::jump_speed_m_per_s, &SafetyLimits::jump_turn_rad_per_s}) {
    l.*number = smaller(l.*number, o.*number);
  }
  l.max_axis_force_n = smaller_axes(l.max_axis_force_n, o.max_axis_force_n);
  l.max_axis_torque_nm = smaller_axes(l.max_axis_torque_nm, o.max_axis_torque_nm);
  if (o.ramp_in_s > l.ramp_in_s) l.ramp_in_s = o.ramp_in_s;
  l.driven_dof &= o.driven_dof;
  if (o.held_periods < l.held_periods) l.held_periods = o.held_periods;
  if (o.lost_periods < l.lost_periods) l.lost_periods = o.lost_periods;
  return l;
}

Real longest_step_s(std::int64_t period_ns) noexcept {
  const Real most_s = seconds_between(0, kMostStepPeriods * period_ns);
  return most_s < kLongestRampTick_s ? most_s : kLongestRampTick_s;
}

Real longest_ramp_s(const SafetyLimits& limits) noexcept {
  const SafetyLimits l = usable(limits);
  const Real force_s = ramp_s(l.max_force_n, l.slew_n_per_s);
  const Real torque_s = ramp_s(l.max_torque_nm, l.slew_nm_per_s);
  return force_s > torque_s ? force_s : torque_s;
}

}  // namespace haptic
