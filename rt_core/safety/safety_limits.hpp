// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Every number of the safety stages in one table, with where it comes from. A device's own are
/// made of its capabilities (hal/device_limits.hpp). A limit can only be lowered: what is too tight
/// to be usable becomes the tightest value that is, never the default and never "no limit".

#include <cstdint>

#include "rt_core/base/scalar.hpp"

namespace haptic {

/// An output may change by this many periods' worth of slew, however late it is: after a stall the
/// hand does not get all that was missed at once.
inline constexpr int kMostStepPeriods = 2;

struct SafetyLimits {
  // Output.
  Real max_force_n = 3.0_r;  ///< norm
  Real max_torque_nm = 0.05_r;
  Vec3 max_axis_force_n = Vec3::Zero();  ///< per axis of D; 0: the norm's limit
  Vec3 max_axis_torque_nm = Vec3::Zero();
  Real slew_n_per_s = 600.0_r;      ///< largest change of force, for any reason
  Real slew_nm_per_s = 10.0_r;      ///< largest change of torque
  Real ramp_in_s = 100.0e-3_r;      ///< after arming; at least 50 ms
  std::uint32_t driven_dof = 0x3f;  ///< bits x y z rx ry rz; the rest of a wrench becomes zero
  // Speed of the handle: full wrench below the first, none above the second, linear between.
  Real full_speed_m_per_s = 1.0_r, zero_speed_m_per_s = 2.0_r;
  Real full_turn_rad_per_s = 15.0_r, zero_turn_rad_per_s = 30.0_r;
  // Age of what the output rests on, in periods of the loop. Up to the first: noted; up to the
  // second: the last wrench is held and decays; beyond: ramp to zero, latched.
  std::int64_t period_ns = 1'000'000;
  std::uint32_t held_periods = 1, lost_periods = 5;
  Real decay_per_period = 0.7_r;  ///< of the held wrench
  /// Shortest turn of a report's pose that no hand can make within its interval: an encoder jumped.
  Real jump_speed_m_per_s = 10.0_r, jump_turn_rad_per_s = 200.0_r;
};

/// `limits` with every number in its range. Tighter than the range: the tightest number of it.
/// Looser, or not a number: the default above. Ranges: forces 0 to 1000 N, torques 0 to 100 N m,
/// slews 0 to 1e6 N/s and 1e5 N m/s (0: the output never leaves zero), ramp in 0.05 to 10 s, fades
/// 0 to 1000 m/s and 1e5 rad/s with the first at most the second, jump speeds likewise, period 10
/// us to 1 s, held <= lost <= 1000 periods, decay 0 to below 1.
[[nodiscard]] SafetyLimits usable(const SafetyLimits& limits) noexcept;

/// The tighter of the two, number by number, both made usable first; the period is that of `own`.
/// An axis limit of 0 is none.
[[nodiscard]] SafetyLimits tighter(const SafetyLimits& own, const SafetyLimits& other) noexcept;

/// Time that counts for the slew of one output at most [s], where outputs come every `period_ns`:
/// kMostStepPeriods of it, and no more than kLongestRampTick_s.
[[nodiscard]] Real longest_step_s(std::int64_t period_ns) noexcept;

/// Longest time that a ramp from the largest wrench to zero takes by the slew limits [s]: what must
/// be shorter than the device's own watchdog. A slew limit of 0 allows no wrench: no ramp.
[[nodiscard]] Real longest_ramp_s(const SafetyLimits& limits) noexcept;

}  // namespace haptic
