// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/reference_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "rt_core/exchange/device_exchange.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr std::uint32_t kNoDrives = kDeviceDriveFault | kDeviceNotHomed;

/// The smaller of two limits, where 0 is none.
double tighter(double a, double b) { return a > 0 && b > 0 ? std::min(a, b) : std::max(a, b); }

DeviceModel device_with(const ReferenceModelSettings& settings) {
  DeviceModel model = settings.device;
  model.encoder_step_m = std::max(model.encoder_step_m, settings.encoder_step_m);
  model.encoder_step_rad = std::max(model.encoder_step_rad, settings.encoder_step_rad);
  model.max_force_n = tighter(model.max_force_n, settings.max_force_n);
  model.max_torque_nm = tighter(model.max_torque_nm, settings.max_torque_nm);
  return model;
}

ReferenceModelSettings checked(const ReferenceModelSettings& settings) {
  if (!(settings.report_rate_hz >= 50 && settings.report_rate_hz <= 10000))
    throw tools::InputError("reference device: the report rate must be from 50 to 10000 Hz");
  if (settings.watchdog_ns < 1 || settings.watchdog_ns > 1'000'000'000)
    throw tools::InputError("reference device: the watchdog must be from 1 ns to 1 s");
  if (!(settings.max_force_n > 0 && settings.max_torque_nm > 0))
    throw tools::InputError("reference device: its largest force and torque must be above 0");
  return settings;
}

/// In whole units, at the ends of the range where it goes beyond.
template <typename Integer>
Integer units(double value, double unit) {
  constexpr double kLow = std::numeric_limits<Integer>::min();
  constexpr double kHigh = std::numeric_limits<Integer>::max();
  return static_cast<Integer>(std::clamp(std::nearbyint(value / unit), kLow, kHigh));
}

std::array<std::int32_t, 3> units(const Vector& v, double unit) {
  return {units<std::int32_t>(v.x(), unit), units<std::int32_t>(v.y(), unit),
          units<std::int32_t>(v.z(), unit)};
}

Vector vector_of(const std::array<std::int32_t, 3>& v, double unit) {
  return unit * Vector(v[0], v[1], v[2]);
}

/// `v` in its direction, no longer than `limit`.
Vector no_longer(const Vector& v, double limit) {
  const double length = v.norm();
  return length > limit ? Vector(v * (limit / length)) : v;
}

// The one of the two quaternions of an orientation that has w >= 0: equal orientations, equal
// bytes.
std::array<std::int32_t, 4> quaternion_units(const Rotation& q) {
  const double sign = std::signbit(q.w()) ? -1 : 1;
  std::array<std::int32_t, 4> out{};
  const std::array<double, 4> xyzw = {q.x(), q.y(), q.z(), q.w()};
  for (std::size_t k = 0; k < 4; ++k)
    out[k] = units<std::int32_t>(sign * xyzw[k], hal::kReferenceOrientationUnit);
  return out;
}

}  // namespace

ReferenceModel::ReferenceModel(const ReferenceModelSettings& settings,
                               std::function<HandAction(double t_s)> hand)
    : settings_(checked(settings)),
      hand_(std::move(hand)),
      device_(device_with(settings), settings.hand, 1.0 / settings.report_rate_hz),
      action_(hand_(0)) {
  place({action_.target.x0_w, action_.target.q_wa, Vector::Zero(), Vector::Zero()});
  power_up();
}

void ReferenceModel::place(const DeviceState& state) {
  device_.place({state.x0_w, state.q_wa, Vector::Zero(), Vector::Zero()});
  acting_ = {};
}

void ReferenceModel::power_up() {
  drives_off();
  jump_m_.setZero();
  cut_ = host_speaks_1_1_ = false;
  fresh_ = true;
  stopped_ = stop_pressed_;
  sequence_ = accepted_ = tick_ = rejected_ = faults_ = 0;
}

void ReferenceModel::drives_off() {
  on_ = false;
  wrench_ = asked_ = {};
  on_periods_ = 0;
  device_.drop_wrenches();
}

std::int64_t ReferenceModel::time_ns() const {
  return std::llround(static_cast<double>(periods_) * 1e9 / settings_.report_rate_hz);
}

double ReferenceModel::time_s() const {
  return static_cast<double>(periods_) / settings_.report_rate_hz;
}

bool ReferenceModel::may_drive() const {
  return !fresh_ && !cut_ && !stopped_ && (faults_ & kNoDrives) == 0;
}

/// Some of the force or torque that it can give is still withheld.
bool ReferenceModel::is_slewing() const {
  const double on_s = static_cast<double>(on_periods_) / settings_.report_rate_hz;
  const double half_s = 0.5e-9 * static_cast<double>(settings_.watchdog_ns);
  const auto time_s = [&](double limit, double rate) { return rate > 0 ? limit / rate : half_s; };
  const DeviceModel model = device_with(settings_);
  constexpr double kRounding_s = 1e-9;
  return on_ && on_s + kRounding_s <
                    std::max(time_s(model.max_force_n, settings_.max_force_rate_n_per_s),
                             time_s(model.max_torque_nm, settings_.max_torque_rate_nm_per_s));
}

/// The power stage begins at zero; from then on a limit that grows period by period, until it is
/// the device's own, shortens what is asked for.
void ReferenceModel::exert() {
  const double on_s = static_cast<double>(on_periods_) / settings_.report_rate_hz;
  const double share = on_s / (0.5e-9 * static_cast<double>(settings_.watchdog_ns));
  const auto grown = [&](double limit, double rate) {
    return rate > 0 ? rate * on_s : limit * share;
  };
  const DeviceModel model = device_with(settings_);
  const double force_n = grown(model.max_force_n, settings_.max_force_rate_n_per_s);
  const double torque_nm = grown(model.max_torque_nm, settings_.max_torque_rate_nm_per_s);
  wrench_ = asked_;
  if (force_n < model.max_force_n) wrench_.force_w = no_longer(asked_.force_w, force_n);
  if (torque_nm < model.max_torque_nm) wrench_.torque_w = no_longer(asked_.torque_w, torque_nm);
}

void ReferenceModel::advance() {
  ++periods_;
  const HandAction next = hand_(time_s());
  acting_ = device_.advance(on_ ? wrench_ : Load{}, {action_.target, next.target});
  action_ = next;
  ++sequence_;
  if (!on_) return;
  if (time_ns() - fed_ns_ < settings_.watchdog_ns) {
    ++on_periods_;
    return exert();
  }
  cut_ = true;
  ++cuts_;
  drives_off();
}

std::size_t ReferenceModel::report_into(std::span<std::uint8_t> bytes) const {
  const DeviceState& state = device_.state();
  const HandTarget sensed = device_.sensed();
  hal::ReferenceReport r;
  const auto set = [&r](bool holds, unsigned bit) {
    if (holds) r.status = static_cast<std::uint8_t>(r.status | bit);
  };
  set((faults_ & kDeviceNotHomed) == 0, hal::kReferenceCalibrated);
  set(on_, hal::kReferenceDrivesOn);
  set(settings_.twist_sensed, hal::kReferenceTwistValid);
  set(cut_, hal::kReferenceWatchdogCut);
  set(stopped_, hal::kReferenceEmergencyStop);
  set(host_speaks_1_1_ && is_slewing(), hal::kReferenceSlewing);
  r.sequence = sequence_;
  r.time_us = static_cast<std::uint64_t>((time_ns() + 500) / 1000);
  r.position = units(sensed.x0_w + jump_m_, hal::kReferencePositionUnit_m);
  r.orientation = quaternion_units(sensed.q_wa);
  if (settings_.twist_sensed) {
    r.velocity = units(state.velocity_w, hal::kReferenceVelocityUnit_m_per_s);
    r.angular_velocity = units(state.angular_velocity_w, hal::kReferenceTurnUnit_rad_per_s);
  }
  r.switches = action_.switches;
  r.faults = (faults_ | (cut_ ? kDeviceWatchdogCut : 0u) | (stopped_ ? kDeviceEmergencyStop : 0u)) &
             hal::kReferenceFaultBits;
  r.accepted_tick = tick_;
  r.rejected = rejected_;
  r.accepted_sequence = accepted_;
  if (host_speaks_1_1_ && settings_.largest_gap_m > 0) {
    const double gap_m = std::clamp(action_.gap_m, 0.0, settings_.largest_gap_m);
    r.gripper = 1 + units<std::uint32_t>(gap_m, hal::kReferenceGapUnit_m);
  }
  hal::encode(r, bytes.first<hal::kReferenceReportBytes>());
  return hal::kReferenceReportBytes;
}

std::vector<std::uint8_t> ReferenceModel::report() const {
  std::vector<std::uint8_t> bytes(hal::kReferenceReportBytes);
  static_cast<void>(report_into(bytes));
  return bytes;
}

bool ReferenceModel::command(std::span<const std::uint8_t> bytes) {
  hal::ReferenceCommand c;
  if (hal::decode(bytes, c) != hal::CodecVerdict::kOk || !hal::is_newer(c.sequence, accepted_)) {
    ++rejected_;
    return false;
  }
  accepted_ = c.sequence;
  tick_ = c.tick;
  fed_ns_ = time_ns();
  if (!c.drives_on) {
    released_ += on_ ? 1u : 0u;
    drives_off();
    fresh_ = cut_ = false;
    stopped_ = stop_pressed_;
  } else if (may_drive()) {
    asked_ = {vector_of(c.force, hal::kReferenceForceUnit_n),
              vector_of(c.torque, hal::kReferenceTorqueUnit_nm)};
    on_ = true;
    exert();
  }
  return true;
}

std::size_t ReferenceModel::answer_into(std::span<std::uint8_t> room) {
  if (room.size() < hal::kReferenceBlockBytes) return 0;
  host_speaks_1_1_ = settings_.speaks_1_1 && room.size() >= hal::kReferenceLongBlockBytes;
  if (!host_speaks_1_1_) {
    hal::encode(block(), room.first<hal::kReferenceBlockBytes>());
    return hal::kReferenceBlockBytes;
  }
  hal::ReferenceLongBlock b;
  b.first = block();
  b.is_displacement = settings_.is_displacement;
  b.latency_us = units<std::uint32_t>(settings_.latency_s, 1e-6);
  b.largest_gap_um = units<std::uint32_t>(settings_.largest_gap_m, hal::kReferenceGapUnit_m);
  b.name = hal::device_text(settings_.name);
  b.serial = hal::device_text(settings_.serial);
  hal::encode(b, room.first<hal::kReferenceLongBlockBytes>());
  return hal::kReferenceLongBlockBytes;
}

hal::ReferenceBlock ReferenceModel::block() const {
  if (stated_) return *stated_;
  const DeviceModel model = device_with(settings_);
  hal::ReferenceBlock b;
  b.twist_sensed = settings_.twist_sensed;
  b.report_period_us = units<std::uint16_t>(1e6 / settings_.report_rate_hz, 1);
  b.watchdog_ms = units<std::uint16_t>(static_cast<double>(settings_.watchdog_ns), 1e6);
  b.max_force = units<std::uint32_t>(model.max_force_n, hal::kReferenceForceUnit_n);
  b.max_torque = units<std::uint32_t>(model.max_torque_nm, hal::kReferenceTorqueUnit_nm);
  b.max_force_rate_mn_per_s = units<std::uint32_t>(settings_.max_force_rate_n_per_s, 1e-3);
  b.max_torque_rate_mnm_per_s = units<std::uint32_t>(settings_.max_torque_rate_nm_per_s, 1e-3);
  b.mass_mg = units<std::uint32_t>(model.mass_kg, 1e-6);
  b.damping_uns_per_m = units<std::uint32_t>(model.damping_ns_per_m, 1e-6);
  b.friction = units<std::uint32_t>(model.coulomb_force_n, hal::kReferenceForceUnit_n);
  b.encoder_step_nm =
      units<std::uint32_t>(std::max(model.encoder_step_m, hal::kReferencePositionUnit_m), 1e-9);
  b.encoder_step_nrad = units<std::uint32_t>(std::max(model.encoder_step_rad, 1e-9), 1e-9);
  return b;
}

void ReferenceModel::set_faults(std::uint32_t device_faults) {
  faults_ = device_faults & hal::kReferenceFaultBits;
  if ((faults_ & kNoDrives) != 0) drives_off();
}

void ReferenceModel::press_emergency_stop(bool pressed) {
  stop_pressed_ = pressed;
  if (!pressed) return;
  stopped_ = true;
  drives_off();
}

void ReferenceModel::jump_encoders(const Vector& by_m) { jump_m_ += by_m; }

}  // namespace haptic::sim
