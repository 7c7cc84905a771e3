// SPDX-License-Identifier: Apache-2.0
#include "hal/device_limits.hpp"

#include <algorithm>
#include <cmath>

namespace haptic::hal {
namespace {

bool is_known(Real limit) noexcept { return std::isfinite(limit) && limit > 0; }

Real known_or(Real limit, Real fallback) noexcept { return is_known(limit) ? limit : fallback; }

/// Per axis: not known is 0 on both sides.
Vec3 known_axes(const Vec3& limits) noexcept {
  return {known_or(limits.x(), 0), known_or(limits.y(), 0), known_or(limits.z(), 0)};
}

/// Largest output and largest change of it, in one unit: force or torque.
struct Span {
  Real largest, slew_per_s;
};

/// @param ramp_s  longest time for a ramp from `largest` to zero; 0: no such rule
Span span_of(Real largest, Real rate_per_s, Real default_slew_per_s, Real ramp_s) noexcept {
  if (!(ramp_s > 0)) return {largest, known_or(rate_per_s, default_slew_per_s)};
  if (is_known(rate_per_s)) return {std::min(largest, rate_per_s * ramp_s), rate_per_s};
  return {largest, std::max(default_slew_per_s, largest / ramp_s)};
}

}  // namespace

SafetyLimits limits_of(const DeviceCapabilities& c, std::int64_t period_ns) noexcept {
  const SafetyLimits defaults;
  SafetyLimits limits;
  const bool watched = c.watchdog_ns > 0;
  const Real share = watched ? 1 : kShareWithoutWatchdog;
  const Real ramp_s = watched ? static_cast<Real>(c.watchdog_ns) * 0.5e-9_r : 0;
  const Span force = span_of(share * known_or(c.max_force_n, defaults.max_force_n),
                             c.max_force_rate_n_per_s, defaults.slew_n_per_s, ramp_s);
  const Span torque = span_of(share * known_or(c.max_torque_nm, defaults.max_torque_nm),
                              c.max_torque_rate_nm_per_s, defaults.slew_nm_per_s, ramp_s);
  limits.max_force_n = force.largest;
  limits.slew_n_per_s = force.slew_per_s;
  limits.max_torque_nm = torque.largest;
  limits.slew_nm_per_s = torque.slew_per_s;
  limits.max_axis_force_n = share * known_axes(c.max_axis_force_n);
  limits.max_axis_torque_nm = share * known_axes(c.max_axis_torque_nm);
  limits.driven_dof = c.driven_dof & kDofAll;
  if (period_ns > 0) limits.period_ns = period_ns;
  return limits;
}

SafetyLimits limits_of_connection(const SafetyLimits& own, const DeviceCapabilities& stated,
                                  Real share) noexcept {
  SafetyLimits device = limits_of(stated, own.period_ns);
  const Real least = std::isfinite(share) ? std::clamp(share, Real{0}, Real{1}) : Real{0};
  device.max_force_n *= least;
  device.max_torque_nm *= least;
  device.max_axis_force_n *= least;
  device.max_axis_torque_nm *= least;
  SafetyLimits limits = own;  // and of those that a device states:
  limits.max_force_n = device.max_force_n;
  limits.max_torque_nm = device.max_torque_nm;
  limits.max_axis_force_n = device.max_axis_force_n;
  limits.max_axis_torque_nm = device.max_axis_torque_nm;
  limits.slew_n_per_s = device.slew_n_per_s;
  limits.slew_nm_per_s = device.slew_nm_per_s;
  limits.driven_dof = device.driven_dof;
  limits = tighter(own, limits);
  Real ramp_s = kLongestRamp_s;
  if (stated.watchdog_ns > 0)
    ramp_s = std::min(ramp_s, static_cast<Real>(stated.watchdog_ns) * 0.5e-9_r);
  limits.max_force_n = std::min(limits.max_force_n, limits.slew_n_per_s * ramp_s);
  limits.max_torque_nm = std::min(limits.max_torque_nm, limits.slew_nm_per_s * ramp_s);
  return limits;
}

LimitsRecord limits_record(const SafetyLimits& limits, const DeviceCapabilities& stated,
                           std::uint32_t connection) noexcept {
  LimitsRecord record;
  record.connection = connection;
  record.driven_dof = limits.driven_dof;
  record.max_force_n = limits.max_force_n;
  record.max_torque_nm = limits.max_torque_nm;
  for (int k = 0; k < 3; ++k) {
    record.max_axis_force_n[k] = limits.max_axis_force_n[k];
    record.max_axis_torque_nm[k] = limits.max_axis_torque_nm[k];
  }
  record.slew_n_per_s = limits.slew_n_per_s;
  record.slew_nm_per_s = limits.slew_nm_per_s;
  record.report_period_ns = stated.report_period_ns;
  return record;
}

}  // namespace haptic::hal
