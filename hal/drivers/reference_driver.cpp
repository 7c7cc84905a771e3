// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/reference_driver.hpp"

#include <algorithm>
#include <cmath>

#include "hal/drivers/reference_short.hpp"

namespace haptic::hal {
namespace {

constexpr int kAsks = 3;
constexpr unsigned kAskTimeout_ms = 100;

Real real(double value) noexcept { return static_cast<Real>(value); }

std::array<double, 3> scaled(const std::array<std::int32_t, 3>& values, double unit) noexcept {
  return {values[0] * unit, values[1] * unit, values[2] * unit};
}
Vec3 vec3_of(const std::array<double, 3>& v) noexcept {
  return {real(v[0]), real(v[1]), real(v[2])};
}

void put(const std::array<double, 3>& values, Real (&out)[3]) noexcept {
  for (std::size_t k = 0; k < 3; ++k) out[k] = real(values[k]);
}

/// `decode` has made sure that the length is near 1; this takes the rest away.
void put_orientation(const std::array<std::int32_t, 4>& q, Real (&out)[4]) noexcept {
  double square = 0;
  for (const double component : q) square += component * component;
  const double scale = 1 / std::sqrt(square);
  for (std::size_t k = 0; k < 4; ++k) out[k] = real(q[k] * scale);
}

/// Factor in [0, 1] that brings `v` within the norm's limit and the limits of single axes (0: that
/// axis has none). One unit below the norm's limit, so that rounding cannot pass it. Scaled by the
/// largest component first: no square overflows.
double factor_within(const Vec3& v, Real limit, const Vec3& axis_limits, double unit) noexcept {
  double largest = 0;
  for (int k = 0; k < 3; ++k) largest = std::max(largest, std::abs(double{v[k]}));
  if (!(largest > 0)) return 0;
  double square = 0;
  double factor = 1;
  for (int k = 0; k < 3; ++k) {
    const double share = double{v[k]} / largest;
    square += share * share;
    const double axis_limit = double{axis_limits[k]} - unit;
    if (axis_limits[k] > 0 && std::abs(double{v[k]}) > axis_limit) {
      factor = std::min(factor, std::max(axis_limit, 0.0) / std::abs(double{v[k]}));
    }
  }
  constexpr double kMostUnits = 2147483646.0;
  const double norm_limit = std::clamp(double{limit} - unit, 0.0, kMostUnits * unit);
  return std::min(factor, norm_limit / largest / std::sqrt(square));
}

/// Nearest whole units; the vector is within the range of the integers.
std::array<std::int32_t, 3> rounded(const Vec3& v, double factor, double unit) noexcept {
  std::array<std::int32_t, 3> units{};
  for (int k = 0; k < 3; ++k) {
    const double x = double{v[k]} * factor / unit;
    units[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(x < 0 ? x - 0.5 : x + 0.5);
  }
  return units;
}

}  // namespace

DeviceCapabilities reference_capabilities() noexcept { return capabilities_of(ReferenceBlock{}); }

DeviceCapabilities capabilities_of(const ReferenceBlock& block) noexcept {
  DeviceCapabilities c;
  c.sensed_dof = block.sensed_dof;
  c.driven_dof = block.driven_dof;
  c.max_force_n = real(block.max_force * kReferenceForceUnit_n);
  c.max_torque_nm = real(block.max_torque * kReferenceTorqueUnit_nm);
  c.max_force_rate_n_per_s = real(block.max_force_rate_mn_per_s * 1.0e-3);
  c.max_torque_rate_nm_per_s = real(block.max_torque_rate_mnm_per_s * 1.0e-3);
  c.max_stiffness_n_per_m = real(block.max_stiffness_mn_per_m * 1.0e-3);
  c.max_damping_ns_per_m = real(block.max_damping_mns_per_m * 1.0e-3);
  c.mass_kg = real(block.mass_mg * 1.0e-6);
  c.damping_ns_per_m = real(block.damping_uns_per_m * 1.0e-6);
  c.coulomb_friction_n = real(block.friction * kReferenceForceUnit_n);
  c.encoder_step_m = real(block.encoder_step_nm * 1.0e-9);
  c.encoder_step_rad = real(block.encoder_step_nrad * 1.0e-9);
  c.workspace_radius_m = real(block.workspace_radius_um * 1.0e-6);
  c.watchdog_ns = std::int64_t{block.watchdog_ms} * 1'000'000;
  c.report_period_ns = std::int64_t{block.report_period_us} * 1000;
  return c;
}

DeviceCapabilities capabilities_of(const ReferenceLongBlock& block) noexcept {
  DeviceCapabilities c = capabilities_of(block.first);
  c.latency_ns = std::int64_t{block.latency_us} * 1000;
  c.largest_gap_m = real(block.largest_gap_um * kReferenceGapUnit_m);
  c.is_displacement = block.is_displacement;
  c.name = block.name;
  c.serial = block.serial;
  return c;
}

bool is_plausible(const DeviceCapabilities& c) noexcept {
  if (check_capabilities(c) != HalStatus::kOk) return false;
  constexpr std::int64_t kMs = 1'000'000;
  if (c.report_period_ns < kMs / 10 || c.report_period_ns > 20 * kMs) return false;
  if (c.watchdog_ns < 2 * c.report_period_ns || c.watchdog_ns > 1000 * kMs) return false;
  if ((c.driven_dof & kDofTranslation) != 0 && !(c.max_force_n > 0)) return false;
  if ((c.driven_dof & kDofRotation) != 0 && !(c.max_torque_nm > 0)) return false;
  if (c.latency_ns > 100 * kMs || (c.is_displacement && c.driven_dof != 0)) return false;
  return c.largest_gap_m <= 1 && c.max_force_n <= 1000 && c.max_torque_nm <= 100 &&
         c.encoder_step_m < 1.0e-3_r && c.encoder_step_rad < 0.1_r;
}

ReferenceDriver::ReferenceDriver(const ReferenceSettings& settings) noexcept : settings_(settings) {
  capabilities_ = settings.capabilities;
  profile_.name = "reference 6-DOF device";
  profile_.vendor_id = settings.vendor_id;
  profile_.product_id = settings.product_id;
  profile_.in_endpoint = 0x81;
  profile_.out_endpoint = 0x01;
  profile_.in_bytes = kReferenceReportBytes;  // a short one ends its transfer by a short packet
  profile_.out_bytes = kReferenceCommandBytes;
}

void ReferenceDriver::forget() noexcept {
  reported_ = calibrated_ = was_calibrated_ = may_drive_ = false;
  asked_on_ = confirmed_ = acting_ = refused_ = false;
  cleared_ = asked_off_ = false;
  held_faults_ = 0;
  behind_ = unanswered_ = 0;
  drives_on_ = false;
  gap_m_.reset();
}

HalStatus ReferenceDriver::start(UsbPort& port) noexcept {
  forget();
  if (port.cancelled()) return HalStatus::kStartFailed;
  if (settings_.ask_device) return ask(port);
  return is_plausible(settings_.capabilities) ? HalStatus::kOk : HalStatus::kBadCapabilities;
}

HalStatus ReferenceDriver::ask(UsbPort& port) noexcept {
  HalStatus status = HalStatus::kTimeout;
  std::array<std::uint8_t, kReferenceLongBlockBytes> room{};
  std::span<std::uint8_t> bytes = room;
  for (int k = 0; k < kAsks && !port.cancelled(); ++k) {
    std::size_t moved = 0;
    const ControlRequest request{kReferenceBlockRequestType, kReferenceBlockRequest,
                                 kReferenceVersion, profile_.interface_number};
    status = port.control(request, bytes, moved, kAskTimeout_ms);
    if (status == HalStatus::kTimeout) continue;
    // A device of 1.0 may stall at a length that it does not know.
    if (status == HalStatus::kTransferFailed && bytes.size() == room.size()) {
      bytes = std::span(room).first(kReferenceBlockBytes);
      continue;
    }
    // A stall: the device does not know the request, so it is not one of this protocol.
    if (status == HalStatus::kTransferFailed) return HalStatus::kStartFailed;
    if (status != HalStatus::kOk) return status;
    ReferenceLongBlock block;
    status = HalStatus::kStartFailed;
    if (moved > bytes.size() || decode_either(bytes.first(moved), block) != CodecVerdict::kOk) {
      continue;
    }
    DeviceCapabilities found = capabilities_of(block);
    found.q_wd = settings_.capabilities.q_wd;
    found.handle_offset_h = settings_.capabilities.handle_offset_h;
    if (!is_plausible(found)) return HalStatus::kStartFailed;
    capabilities_ = found;
    minor_ = block.minor;
    largest_gap_um_ = block.largest_gap_um;
    return HalStatus::kOk;
  }
  return port.cancelled() ? HalStatus::kStartFailed : status;
}

ReportVerdict ReferenceDriver::read(std::span<const std::uint8_t> bytes, std::int64_t,
                                    DeviceState& state) noexcept {
  ReferenceReport report;
  const CodecVerdict verdict = decode_either(bytes, report);
  if (verdict == CodecVerdict::kBadLength) return ReportVerdict::kBadLength;
  if (verdict == CodecVerdict::kBadNumber) return ReportVerdict::kBadNumber;
  if (verdict != CodecVerdict::kOk || !is_of_version(report)) return ReportVerdict::kBadCheck;
  if (report.gripper > largest_gap_um_ + 1) return ReportVerdict::kBadNumber;
  const bool behind = reported_ && !is_newer(report.sequence, last_sequence_);
  if (behind && !follow_restart(report)) return ReportVerdict::kNotAdvancing;
  const std::uint32_t sent = sequence_;
  if (behind) {
    forget();
    held_faults_ = kDeviceDriveFault;
  }
  behind_ = 0;
  follow_refusals(report);
  if (behind && is_newer(sent, sequence_)) sequence_ = sent;  // some may still be on their way
  follow_drives(report);
  follow_acceptance(report);
  reported_ = true;
  last_sequence_ = report.sequence;

  put(scaled(report.position, kReferencePositionUnit_m), state.pose_dh.p_m);
  put_orientation(report.orientation, state.pose_dh.q_xyzw);
  state.twist_valid = (report.status & kReferenceTwistValid) != 0;
  state.twist_d = TwistRecord{};
  if (state.twist_valid) {
    put(scaled(report.velocity, kReferenceVelocityUnit_m_per_s), state.twist_d.linear_m_per_s);
    put(scaled(report.angular_velocity, kReferenceTurnUnit_rad_per_s),
        state.twist_d.angular_rad_per_s);
  }
  gap_m_.reset();
  if (report.gripper != 0) gap_m_ = real((report.gripper - 1) * kReferenceGapUnit_m);
  state.link = calibrated_ ? LinkState::kReady : LinkState::kStarting;
  state.switches = report.switches;
  state.faults = report.faults | held_faults_ | (refused_ ? kDeviceRefused : 0u);
  return ReportVerdict::kState;
}

/// A device uses what 1.1 has added only where it says that it speaks it, and has a gripper.
bool ReferenceDriver::is_of_version(const ReferenceReport& report) const noexcept {
  if (minor_ == 0 && (report.status & kReferenceSlewing) != 0) return false;
  return report.gripper == 0 || largest_gap_um_ != 0;
}

/// One that stands still, or an old report among new ones, is no restart.
bool ReferenceDriver::follow_restart(const ReferenceReport& report) noexcept {
  const bool advances = behind_ > 0 && is_newer(report.sequence, behind_at_);
  behind_ = advances ? behind_ + 1 : 1;
  behind_at_ = report.sequence;
  return behind_ >= kReferenceRestartReports;
}

/// A refusal stands until the device has accepted a command that is newer than those before it.
void ReferenceDriver::follow_refusals(const ReferenceReport& report) noexcept {
  if (!reported_) {
    sequence_ = report.accepted_sequence;
  } else if (report.rejected != rejected_) {
    refused_ = true;
    refused_at_ = report.accepted_sequence;
  } else if (refused_ && is_newer(report.accepted_sequence, refused_at_)) {
    refused_ = false;
  }
  rejected_ = report.rejected;
}

void ReferenceDriver::follow_acceptance(const ReferenceReport& report) noexcept {
  const bool waits = reported_ && is_newer(sequence_, report.accepted_sequence);
  unanswered_ = waits && report.accepted_sequence == accepted_ ? unanswered_ + 1 : 0;
  accepted_ = report.accepted_sequence;
  drives_on_ = (report.status & kReferenceDrivesOn) != 0;
}

CommandReceipt ReferenceDriver::receipt() const noexcept {
  return {reported_, drives_on_, sequence_, accepted_, unanswered_};
}

void ReferenceDriver::follow_drives(const ReferenceReport& report) noexcept {
  const auto says = [&](ReferenceStatusBit bit) { return (report.status & bit) != 0; };
  std::uint32_t causes = report.faults & (kDeviceWatchdogCut | kDeviceEmergencyStop);
  if (says(kReferenceWatchdogCut)) causes |= kDeviceWatchdogCut;
  if (says(kReferenceEmergencyStop)) causes |= kDeviceEmergencyStop;
  calibrated_ = says(kReferenceCalibrated) && (report.faults & kDeviceNotHomed) == 0;
  if (!calibrated_ && was_calibrated_) causes |= kDeviceNotHomed;
  was_calibrated_ = was_calibrated_ || calibrated_;
  cleared_ = cleared_ || (asked_off_ && !is_newer(off_at_, report.accepted_sequence));
  may_drive_ = cleared_ && calibrated_ && causes == 0;

  const bool dropped = confirmed_ && !says(kReferenceDrivesOn);
  if (may_drive_ && dropped) causes |= kDeviceDriveFault;
  held_faults_ |= causes;
  if (!may_drive_ || dropped) {
    confirmed_ = acting_ = false;
  } else if (asked_on_ && says(kReferenceDrivesOn) &&
             !is_newer(asked_since_, report.accepted_sequence)) {
    confirmed_ = true;  // not before: it might be the answer to an older command
  }
}

std::size_t ReferenceDriver::write(const Wrench& wrench_d, std::uint64_t tick,
                                   std::span<std::uint8_t> report, Wrench& delivered_d) noexcept {
  delivered_d = Wrench{};
  if (!reported_ || report.size() < kReferenceCommandBytes) return 0;
  const Wrench asked =
      is_finite(wrench_d) ? project_wrench(wrench_d, capabilities_.driven_dof) : Wrench{};
  ReferenceCommand command;
  command.force = rounded(asked.force_w,
                          factor_within(asked.force_w, capabilities_.max_force_n,
                                        capabilities_.max_axis_force_n, kReferenceForceUnit_n),
                          kReferenceForceUnit_n);
  command.torque = rounded(asked.torque_w,
                           factor_within(asked.torque_w, capabilities_.max_torque_nm,
                                         capabilities_.max_axis_torque_nm, kReferenceTorqueUnit_nm),
                           kReferenceTorqueUnit_nm);
  constexpr std::array<std::int32_t, 3> kNothing{};
  const bool nothing = command.force == kNothing && command.torque == kNothing;

  command.drives_on = may_drive_;
  // A device without drives to confirm needs a host that has seen the fault all the same.
  if (nothing && (confirmed_ || (may_drive_ && capabilities_.driven_dof == 0))) {
    acting_ = true;
    held_faults_ = 0;
  }
  if (acting_) {
    delivered_d.force_w = vec3_of(scaled(command.force, kReferenceForceUnit_n));
    delivered_d.torque_w = vec3_of(scaled(command.torque, kReferenceTorqueUnit_nm));
  } else {
    command.force = command.torque = kNothing;
  }
  return send(command, tick, report);
}

std::size_t ReferenceDriver::release(std::uint64_t tick, std::span<std::uint8_t> report) noexcept {
  if (!reported_ || report.size() < kReferenceCommandBytes) return 0;
  confirmed_ = acting_ = false;
  ReferenceCommand off;
  off.drives_on = false;
  return send(off, tick, report);
}

std::size_t ReferenceDriver::send(ReferenceCommand& command, std::uint64_t tick,
                                  std::span<std::uint8_t> report) noexcept {
  command.sequence = ++sequence_;
  command.tick = static_cast<std::uint32_t>(tick & 0xffff'ffffu);
  if (command.drives_on && !asked_on_) asked_since_ = sequence_;
  asked_on_ = command.drives_on;
  if (!command.drives_on && !asked_off_) {
    asked_off_ = true;
    off_at_ = sequence_;
  }
  encode(command, report.first<kReferenceCommandBytes>());
  return kReferenceCommandBytes;
}

std::size_t ReferenceDriver::zero_report(std::span<std::uint8_t> report) const noexcept {
  if (!reported_ || report.size() < kReferenceCommandBytes) return 0;
  ReferenceCommand command;
  command.sequence = sequence_ + (1u << 30);
  command.drives_on = false;
  encode(command, report.first<kReferenceCommandBytes>());
  return kReferenceCommandBytes;
}

}  // namespace haptic::hal
