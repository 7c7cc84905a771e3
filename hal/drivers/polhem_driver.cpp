// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/polhem_driver.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace haptic::hal {
namespace {

constexpr int kStartTries = 10;
constexpr unsigned kStart_ms = 100;
/// A report that was under way when the command left, and one more, may still show the old counts.
constexpr int kMostOldReports = 4;
constexpr double kMostCurrent_a = 3.0;  // full PWM range of the board

std::array<std::int16_t, 3> milliamperes(const Column3& currents_a, double most_a) noexcept {
  const double largest = currents_a.cwiseAbs().maxCoeff();
  const double share = largest > most_a ? most_a / largest : 1.0;
  std::array<std::int16_t, 3> ma{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double wanted = currents_a[static_cast<Eigen::Index>(i)] * share * 1000.0;
    ma[i] = static_cast<std::int16_t>(std::trunc(wanted));  // towards zero: never beyond the limit
  }
  return ma;
}

}  // namespace

DeviceCapabilities polhem_capabilities() noexcept {
  DeviceCapabilities c;
  c.sensed_dof = kDofAll;
  c.driven_dof = kDofTranslation;
  c.max_force_n = 5.0_r;
  c.max_axis_force_n = Vec3::Constant(5.0_r);
  c.max_stiffness_n_per_m = 800.0_r;
  c.max_damping_ns_per_m = 8.0_r;
  c.encoder_step_m = 60.0e-6_r;  // 3.1e-4 rad at 174 mm
  c.encoder_step_rad = 6.2e-3_r;
  c.workspace_radius_m = 0.100_r;
  c.watchdog_ns = 500'000'000;
  c.report_period_ns = 1'000'000;
  // A quarter turn about z: x of D, from the base towards the operator, becomes -y.
  c.q_wd = Quat(std::sqrt(0.5_r), 0.0_r, 0.0_r, -std::sqrt(0.5_r));
  return c;
}

PolhemDriver::PolhemDriver(const PolhemSettings& settings) noexcept
    : settings_(settings), usable_(is_usable(settings.geometry)) {
  if (usable_) arm_ = PolhemKinematics(settings.geometry);
  capabilities_ = settings.capabilities;
  if (!settings_.has_deadman) capabilities_.driven_dof = 0;
  if (!(settings_.max_current_a >= 0.0 && settings_.max_current_a <= kMostCurrent_a)) {
    settings_.max_current_a = PolhemSettings{}.max_current_a;
  }
  profile_.name = "Polhem / WoodenHaptics";
  profile_.vendor_id = 0x1234;
  profile_.product_id = 0x0006;
  profile_.in_endpoint = 0x81;
  profile_.out_endpoint = 0x01;
  profile_.in_bytes = 64;  // the board's packets may be this long; its reports have 14
  profile_.out_bytes = kPolhemReportBytes;
  profile_.lock_step = true;
  profile_.kernel_driver = true;
}

HalStatus PolhemDriver::start(UsbPort& port) noexcept {
  calibration_ = Calibration::kNone;
  reports_since_sent_ = 0;
  angles_ = {};
  if (!usable_) return HalStatus::kBadCapabilities;
  std::array<std::uint8_t, kPolhemReportBytes> zero{};
  std::array<std::uint8_t, 64> bytes{};
  for (int i = 0; i < kStartTries; ++i) {
    if (port.cancelled()) return HalStatus::kTimeout;
    const HalStatus written = port.write(zero, kStart_ms);
    if (written != HalStatus::kOk && written != HalStatus::kTimeout) return written;
    std::size_t moved = 0;
    const HalStatus came = port.read(bytes, moved, kStart_ms);
    if (came == HalStatus::kTimeout) continue;
    if (came != HalStatus::kOk) return came;
    PolhemReport report;
    const PolhemVerdict verdict =
        decode(std::span(bytes).first(std::min(moved, bytes.size())), report);
    return verdict == PolhemVerdict::kOk ? HalStatus::kOk : HalStatus::kStartFailed;
  }
  return HalStatus::kStartFailed;
}

void PolhemDriver::follow_calibration(const PolhemReport& report) noexcept {
  if (calibration_ == Calibration::kSent) {
    ++reports_since_sent_;
    bool arrived = !report.switch_pressed;
    for (std::size_t i = 0; i < 6; ++i) {
      const int off = int{report.counts[i]} - int{settings_.geometry.calibration_counts[i]};
      arrived = arrived && std::abs(off) <= kCountSlack;
    }
    if (arrived) {
      calibration_ = Calibration::kDone;
    } else if (reports_since_sent_ >= kMostOldReports) {
      // Still flagged: the command was lost, so it goes out again. Not flagged, yet the counts are
      // others: they were not set, and the operator must press again.
      calibration_ = report.switch_pressed ? Calibration::kPressed : Calibration::kNone;
    }
  } else if (report.switch_pressed) {
    calibration_ = Calibration::kPressed;
  }
}

ReportVerdict PolhemDriver::read(std::span<const std::uint8_t> report, std::int64_t /*stamp_ns*/,
                                 DeviceState& state) noexcept {
  PolhemReport said;
  switch (decode(report, said)) {
    case PolhemVerdict::kBadLength:
      return ReportVerdict::kBadLength;
    case PolhemVerdict::kBadNumber:
      return ReportVerdict::kBadNumber;
    case PolhemVerdict::kOk:
      break;
  }
  follow_calibration(said);
  state.faults = 0;
  state.switches = said.switch_pressed ? 1u : 0u;
  state.twist_d = TwistRecord{};
  state.twist_valid = false;
  state.link = LinkState::kStarting;
  if (calibration_ != Calibration::kDone) return ReportVerdict::kState;

  angles_ = arm_.angles_of(said.counts);
  const Column3 p_p = arm_.position_at(angles_);
  const auto q = arm_.orientation_at(angles_);
  Pose pose_dh;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    pose_dh.p_wa[i] = static_cast<Real>(p_p[i] - settings_.geometry.origin_p_m[k]);
  }
  pose_dh.q_wa = q.cast<Real>();
  state.pose_dh = record_of(pose_dh);
  state.link = LinkState::kReady;
  return ReportVerdict::kState;
}

std::size_t PolhemDriver::write(const Wrench& wrench_d, std::uint64_t /*tick*/,
                                std::span<std::uint8_t> report, Wrench& delivered_d) noexcept {
  delivered_d = Wrench{};
  if (report.size() < kPolhemReportBytes) return 0;
  PolhemCommand command;
  if (calibration_ == Calibration::kPressed) {
    command.set_counts = true;
    command.counts = settings_.geometry.calibration_counts;
    calibration_ = Calibration::kSent;
    reports_since_sent_ = 0;
  } else if (calibration_ == Calibration::kDone) {
    const Square3 jacobian = arm_.jacobian_at(angles_);
    const Vec3 force_d = project_wrench(wrench_d, capabilities_.driven_dof).force_w;
    const Column3 wanted_a = arm_.currents_for(jacobian, force_d.cast<double>());
    if (is_finite(wanted_a)) {
      command.currents_ma = milliamperes(wanted_a, settings_.max_current_a);
      const Column3 sent_a(command.currents_ma[0], command.currents_ma[1], command.currents_ma[2]);
      delivered_d.force_w = arm_.force_of(jacobian, sent_a * 1.0e-3).cast<Real>();
    }
  }
  encode(command, std::span<std::uint8_t, kPolhemReportBytes>(report.data(), kPolhemReportBytes));
  return kPolhemReportBytes;
}

std::size_t PolhemDriver::zero_report(std::span<std::uint8_t> report) const noexcept {
  if (report.size() < kPolhemReportBytes) return 0;
  encode(PolhemCommand{},
         std::span<std::uint8_t, kPolhemReportBytes>(report.data(), kPolhemReportBytes));
  return kPolhemReportBytes;
}

}  // namespace haptic::hal
