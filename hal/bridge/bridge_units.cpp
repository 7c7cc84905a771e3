// SPDX-License-Identifier: Apache-2.0
#include "hal/bridge/bridge_units.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "hal/drivers/reference_codec.hpp"

namespace haptic::hal {
namespace {

constexpr double kFarthest_m = 2.0;  // the protocol has 2.147 m
constexpr std::int64_t kMostLatency_ns = 100'000'000;
constexpr std::uint32_t kMostGap_um = 1'000'000;
constexpr double kLeastQuaternion = 1.0e-3;

template <typename Integer>
Integer in_units(double value, double unit) noexcept {
  constexpr double kLeast = std::numeric_limits<Integer>::min();
  constexpr double kMost = std::numeric_limits<Integer>::max();
  const double units = value / unit;
  if (!(units == units)) return 0;
  return static_cast<Integer>(std::clamp(std::nearbyint(units), kLeast, kMost));
}

template <std::size_t N>
bool all_finite(const Real (&values)[N]) noexcept {
  return std::ranges::all_of(values, [](Real v) { return std::isfinite(v); });
}

}  // namespace

haptic_facts facts_of(const DeviceCapabilities& c, std::int64_t watchdog_ns) noexcept {
  const auto u32 = [](Real value, double unit) {
    return in_units<std::uint32_t>(double{value}, unit);
  };
  haptic_facts facts{};
  facts.twist_sensed = 1;  // each report says if it is
  facts.sensed_dof = static_cast<std::uint8_t>(c.sensed_dof & kDofAll);
  std::uint32_t driven = c.driven_dof & c.sensed_dof;
  if (!(c.max_force_n > 0)) driven &= ~std::uint32_t{kDofTranslation};
  if (!(c.max_torque_nm > 0)) driven &= ~std::uint32_t{kDofRotation};
  if (c.is_displacement) driven = 0;
  facts.driven_dof = static_cast<std::uint8_t>(driven & kDofAll);
  const std::int64_t period_us = std::clamp<std::int64_t>(c.report_period_ns / 1000, 100, 20'000);
  facts.report_period_us = static_cast<std::uint16_t>(period_us);
  facts.watchdog_ms = static_cast<std::uint16_t>(
      std::clamp<std::int64_t>(watchdog_ns / 1'000'000, (2 * period_us + 999) / 1000, 1000));
  facts.max_force = u32(c.max_force_n, kReferenceForceUnit_n);
  facts.max_torque = u32(c.max_torque_nm, kReferenceTorqueUnit_nm);
  facts.max_force_rate_mn_per_s = u32(c.max_force_rate_n_per_s, 1.0e-3);
  facts.max_torque_rate_mnm_per_s = u32(c.max_torque_rate_nm_per_s, 1.0e-3);
  facts.max_stiffness_mn_per_m = u32(c.max_stiffness_n_per_m, 1.0e-3);
  facts.max_damping_mns_per_m = u32(c.max_damping_ns_per_m, 1.0e-3);
  facts.mass_mg = u32(c.mass_kg, 1.0e-6);
  facts.damping_uns_per_m = u32(c.damping_ns_per_m, 1.0e-6);
  facts.friction = u32(c.coulomb_friction_n, kReferenceForceUnit_n);
  facts.encoder_step_nm = u32(c.encoder_step_m, 1.0e-9);
  facts.encoder_step_nrad = u32(c.encoder_step_rad, 1.0e-9);
  facts.workspace_radius_um = u32(c.workspace_radius_m, 1.0e-6);
  facts.is_displacement = c.is_displacement ? 1 : 0;
  facts.latency_us =
      static_cast<std::uint32_t>(std::clamp<std::int64_t>(c.latency_ns, 0, kMostLatency_ns) / 1000);
  facts.largest_gap_um = std::min(u32(c.largest_gap_m, kReferenceGapUnit_m), kMostGap_um);
  if (is_text(c.name)) std::ranges::copy(c.name, facts.name);
  if (is_text(c.serial)) std::ranges::copy(c.serial, facts.serial);
  return facts;
}

bool sample_of(const BridgeSample& sample, haptic_sample& out) noexcept {
  const PoseRecord& pose = sample.pose_dh;
  if (!all_finite(pose.p_m) || !all_finite(pose.q_xyzw)) return false;
  double square = 0;
  for (const Real component : pose.q_xyzw) square += double{component} * double{component};
  if (!(square > kLeastQuaternion) || !(square < 1 / kLeastQuaternion)) return false;
  for (const Real position : pose.p_m) {
    if (std::abs(double{position}) > kFarthest_m) return false;
  }
  haptic_sample made{};
  made.time_us = static_cast<std::uint64_t>(std::max<std::int64_t>(sample.sampled_ns / 1000, 0));
  const double length = std::sqrt(square);
  for (std::size_t k = 0; k < 3; ++k)
    made.position_nm[k] = in_units<std::int32_t>(double{pose.p_m[k]}, kReferencePositionUnit_m);
  for (std::size_t k = 0; k < 4; ++k)
    made.orientation[k] =
        in_units<std::int32_t>(double{pose.q_xyzw[k]} / length, kReferenceOrientationUnit);
  const TwistRecord& twist = sample.twist_d;
  const bool has_twist =
      sample.twist_valid && all_finite(twist.linear_m_per_s) && all_finite(twist.angular_rad_per_s);
  made.twist_is_missing = !has_twist;
  for (std::size_t k = 0; has_twist && k < 3; ++k) {
    made.velocity_um_per_s[k] =
        in_units<std::int32_t>(double{twist.linear_m_per_s[k]}, kReferenceVelocityUnit_m_per_s);
    made.angular_velocity_urad_per_s[k] =
        in_units<std::int32_t>(double{twist.angular_rad_per_s[k]}, kReferenceTurnUnit_rad_per_s);
  }
  made.switches = sample.switches;
  made.gap_is_measured = sample.gap_m >= 0 ? 1 : 0;  // not where it is no number
  if (made.gap_is_measured != 0)
    made.gap_um = in_units<std::uint32_t>(double{sample.gap_m}, kReferenceGapUnit_m);
  made.faults = sample.faults & (kDeviceOverheated | kDeviceDriveFault);
  made.is_calibrated = sample.calibrated;
  made.stop_is_pressed = sample.emergency_stop;
  made.is_fatal = (sample.faults & kDeviceDriveFault) != 0;
  out = made;
  return true;
}

Wrench wrench_of(const haptic_drive& drive) noexcept {
  Wrench wrench;
  if (drive.is_on == 0) return wrench;
  for (int k = 0; k < 3; ++k) {
    wrench.force_w[k] = static_cast<Real>(drive.force[k] * kReferenceForceUnit_n);
    wrench.torque_w[k] = static_cast<Real>(drive.torque[k] * kReferenceTorqueUnit_nm);
  }
  return wrench;
}

}  // namespace haptic::hal
