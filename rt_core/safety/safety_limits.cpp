// SPDX-License-Identifier: Apache-2.0
#include "rt_core/safety/safety_limits.hpp"

#include <cmath>

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

// Comparisons with NaN are false: it takes the default.
void keep_or(Real& value, bool in_range, Real otherwise) noexcept {
  if (!in_range) value = otherwise;
}

void keep_axes(Vec3& axes, Real largest) noexcept {
  for (int k = 0; k < 3; ++k) keep_or(axes[k], axes[k] >= 0.0_r && axes[k] <= largest, 0.0_r);
}

// A fade from `full` to `zero`: both are replaced where they are not in order.
void keep_fade(Real& full, Real& zero, Real largest, Real full_otherwise,
               Real zero_otherwise) noexcept {
  const bool in_order = full > 0.0_r && zero > full && zero <= largest;
  keep_or(full, in_order, full_otherwise);
  keep_or(zero, in_order, zero_otherwise);
}

}  // namespace

SafetyLimits usable(const SafetyLimits& limits) noexcept {
  const SafetyLimits safe;
  SafetyLimits l = limits;
  keep_or(l.max_force_n, l.max_force_n >= 0.0_r && l.max_force_n <= kLargestForce_n,
          safe.max_force_n);
  keep_or(l.max_torque_nm, l.max_torque_nm >= 0.0_r && l.max_torque_nm <= kLargestTorque_nm,
          safe.max_torque_nm);
  keep_axes(l.max_axis_force_n, kLargestForce_n);
  keep_axes(l.max_axis_torque_nm, kLargestTorque_nm);
  keep_or(l.slew_n_per_s, l.slew_n_per_s > 0.0_r && l.slew_n_per_s <= kLargestSlew_n_per_s,
          safe.slew_n_per_s);
  keep_or(l.slew_nm_per_s, l.slew_nm_per_s > 0.0_r && l.slew_nm_per_s <= kLargestSlew_nm_per_s,
          safe.slew_nm_per_s);
  keep_or(l.ramp_in_s, l.ramp_in_s >= kMinRampIn_s && l.ramp_in_s <= kLongestRampIn_s,
          safe.ramp_in_s);
  l.driven_dof &= safe.driven_dof;
  keep_fade(l.full_speed_m_per_s, l.zero_speed_m_per_s, kLargestSpeed_m_per_s,
            safe.full_speed_m_per_s, safe.zero_speed_m_per_s);
  keep_fade(l.full_turn_rad_per_s, l.zero_turn_rad_per_s, kLargestTurn_rad_per_s,
            safe.full_turn_rad_per_s, safe.zero_turn_rad_per_s);
  if (l.period_ns < kShortestPeriod_ns || l.period_ns > kLongestPeriod_ns) {
    l.period_ns = safe.period_ns;
  }
  if (l.held_periods > l.lost_periods || l.lost_periods > kMostLostPeriods) {
    l.held_periods = safe.held_periods;
    l.lost_periods = safe.lost_periods;
  }
  keep_or(l.decay_per_period, l.decay_per_period >= 0.0_r && l.decay_per_period < 1.0_r,
          safe.decay_per_period);
  keep_or(l.jump_speed_m_per_s,
          l.jump_speed_m_per_s > 0.0_r && l.jump_speed_m_per_s <= kLargestSpeed_m_per_s,
          safe.jump_speed_m_per_s);
  keep_or(l.jump_turn_rad_per_s,
          l.jump_turn_rad_per_s > 0.0_r && l.jump_turn_rad_per_s <= kLargestTurn_rad_per_s,
          safe.jump_turn_rad_per_s);
  return l;
}

Real longest_ramp_s(const SafetyLimits& limits) noexcept {
  const SafetyLimits l = usable(limits);
  const Real force_s = l.max_force_n / l.slew_n_per_s;
  const Real torque_s = l.max_torque_nm / l.slew_nm_per_s;
  return force_s > torque_s ? force_s : torque_s;
}

}  // namespace haptic
