// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/falcon_driver.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hal/drivers/falcon_firmware.hpp"

namespace haptic::hal {
namespace {

constexpr int kMostMisfits = 3;

Column3 middle_f() noexcept { return {0.0, 0.0, kFalconCentre_m}; }

/// Motor values for torques, the largest within `kFalconMaxMotor`, the ratios kept.
std::array<std::int16_t, 3> motors_for(const Column3& torques_nm) noexcept {
  const Column3 wanted = torques_nm * FalconDriver::kMotorPerTorque;
  const double largest = wanted.cwiseAbs().maxCoeff();
  const double share = largest > kFalconMaxMotor ? kFalconMaxMotor / largest : 1.0;
  std::array<std::int16_t, 3> motors{};
  for (std::size_t i = 0; i < 3; ++i) {
    motors[i] =
        static_cast<std::int16_t>(std::nearbyint(wanted[static_cast<Eigen::Index>(i)] * share));
  }
  return motors;
}

}  // namespace

DeviceCapabilities falcon_capabilities() noexcept {
  DeviceCapabilities c;
  c.sensed_dof = kDofTranslation;
  c.driven_dof = kDofTranslation;
  c.max_force_n = 8.0_r;
  c.max_axis_force_n = Vec3::Constant(8.0_r);
  c.max_stiffness_n_per_m = 3000.0_r;
  c.max_damping_ns_per_m = 20.0_r;
  c.encoder_step_m = 60.0e-6_r;
  c.workspace_radius_m = 0.040_r;
  c.report_period_ns = 1'000'000;
  // A quarter turn about x: y of D, up, becomes z, and z of D, towards the operator, becomes -y.
  c.q_wd = Quat(std::sqrt(0.5_r), std::sqrt(0.5_r), 0.0_r, 0.0_r);
  return c;
}

FalconDriver::FalconDriver(FalconSettings settings)
    : settings_(std::move(settings)), arm_(settings_.geometry), position_f_(middle_f()) {
  capabilities_ = settings_.capabilities;
  profile_.name = "Novint Falcon";
  profile_.vendor_id = 0x0403;
  profile_.product_id = 0xcb48;
  profile_.in_endpoint = 0x81;
  profile_.out_endpoint = 0x02;
  profile_.bulk = true;
  profile_.in_bytes = kFtdiPacketBytes;
  profile_.out_bytes = kFalconPacketBytes;
  profile_.lock_step = true;
  profile_.kernel_driver = true;  // ftdi_sio, where its table has this identity
}

void FalconDriver::forget() noexcept {
  stream_.clear();
  position_f_ = middle_f();
  homed_ = placed_ = was_homed_ = false;
  misfits_ = 0;
}

HalStatus FalconDriver::start(UsbPort& port) noexcept {
  forget();
  bool runs = false;
  if (const HalStatus s = set_falcon_run_mode(port); s != HalStatus::kOk) return s;
  if (const HalStatus s = probe_falcon(port, runs); s != HalStatus::kOk || runs) return s;
  const HalStatus loaded =
      load_falcon_firmware(port,
                           {settings_.firmware_path.c_str(), settings_.known_firmware,
                            settings_.accept_unknown_firmware},
                           settings_.load_attempts);
  if (loaded != HalStatus::kOk) return loaded;
  if (const HalStatus s = probe_falcon(port, runs); s != HalStatus::kOk) return s;
  return runs ? HalStatus::kOk : HalStatus::kStartFailed;
}

ReportVerdict FalconDriver::read(std::span<const std::uint8_t> report, std::int64_t /*stamp_ns*/,
                                 DeviceState& state) noexcept {
  if (report.size() < kFtdiStatusBytes || report.size() > kMaxReportBytes) {
    return ReportVerdict::kBadLength;
  }
  FalconReport newest;
  bool found = false, broken = false;
  for (std::size_t i = 0; i < report.size(); ++i) {
    if (i % kFtdiPacketBytes < kFtdiStatusBytes) continue;  // each USB packet has its own
    const FalconStream::Step step = stream_.push(report[i]);
    if (step == FalconStream::Step::kPacket) {
      // Unlike a lost byte, a wrong one leaves the brackets in place.
      const bool good = decode(stream_.packet(), newest);
      found = found || good;
      broken = broken || !good;
    }
    broken = broken || step == FalconStream::Step::kBroken;
  }
  if (found) return take(newest, state);
  return broken ? ReportVerdict::kBadCheck : ReportVerdict::kNothing;
}

ReportVerdict FalconDriver::take(const FalconReport& report, DeviceState& state) noexcept {
  if (!report.all_homed()) {
    homed_ = placed_ = false;
    misfits_ = 0;
    state.link = LinkState::kStarting;
    state.faults = was_homed_ ? std::uint32_t{kDeviceNotHomed} : 0u;
    state.switches = report.buttons;
    state.twist_valid = false;
    return ReportVerdict::kState;
  }
  if (!homed_) position_f_ = middle_f();  // what was found before homing is of another zero
  homed_ = true;
  if (!arm_.position_at(arm_.angles_of(report.counts), position_f_)) {
    if (++misfits_ >= kMostMisfits) {
      position_f_ = middle_f();
      placed_ = false;
      misfits_ = 0;
    }
    return ReportVerdict::kBadNumber;
  }
  misfits_ = 0;
  placed_ = was_homed_ = true;
  const Column3 p_d = position_f_ - middle_f();
  state.pose_dh = PoseRecord{};
  for (int k = 0; k < 3; ++k) state.pose_dh.p_m[k] = static_cast<Real>(p_d[k]);
  state.twist_d = TwistRecord{};
  state.twist_valid = false;
  state.link = LinkState::kReady;
  state.faults = 0;
  state.switches = report.buttons;
  return ReportVerdict::kState;
}

std::size_t FalconDriver::write(const Wrench& wrench_d, std::uint64_t /*tick*/,
                                std::span<std::uint8_t> report, Wrench& delivered_d) noexcept {
  delivered_d = Wrench{};
  if (report.size() < kFalconPacketBytes) return 0;
  FalconCommand command;
  command.homing = !homed_;
  command.lights = homed_ ? kFalconGreen : kFalconRed;
  Square3 jacobian;
  Column3 torques = Column3::Zero();
  const Column3 force = wrench_d.force_w.cast<double>();
  if (placed_ && is_finite(force) && arm_.jacobian_at(position_f_, jacobian) &&
      FalconKinematics::torques_for(jacobian, force, torques)) {
    command.motors = motors_for(torques);
    const Column3 rounded(command.motors[0], command.motors[1], command.motors[2]);
    delivered_d.force_w =
        FalconKinematics::force_of(jacobian, rounded / kMotorPerTorque).cast<Real>();
  }
  const FalconPacket packet = encode(command);
  std::copy(packet.begin(), packet.end(), report.begin());
  return packet.size();
}

std::size_t FalconDriver::zero_report(std::span<std::uint8_t> report) const noexcept {
  if (report.size() < kFalconPacketBytes) return 0;
  FalconCommand command;  // no motor value
  command.lights = kFalconRed;
  const FalconPacket packet = encode(command);
  std::copy(packet.begin(), packet.end(), report.begin());
  return packet.size();
}

}  // namespace haptic::hal
