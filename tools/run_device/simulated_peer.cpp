// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/simulated_peer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace haptic::tools {
namespace {

constexpr double kMass_kg = 0.2, kDamping_ns_per_m = 2.0;
// The hand: a spring and a damper to where it wants to be.
constexpr double kHandSpring_n_per_m = 300.0, kHandDamping_ns_per_m = 10.0;

// The hand's cycle [s]: it rests with the deadman switch released, goes down with it held, presses,
// comes up, releases it. Where there are two they do so together.
constexpr double kRest_s = 0.5, kDown_s = 1.0, kPress_s = 2.0, kUp_s = 1.0;
constexpr double kCycle_s = kRest_s + kDown_s + kPress_s + kUp_s;

std::int32_t units(double value, double unit) noexcept {
  constexpr double kMost = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::clamp(std::nearbyint(value / unit), -kMost, kMost));
}

/// The protocol's 20 ms, or the two periods that it asks for at the least.
std::uint16_t watchdog_ms(std::int64_t period_ns) noexcept {
  const std::int64_t two_periods_ms = (2 * period_ns + 999'999) / 1'000'000;
  return static_cast<std::uint16_t>(std::max<std::int64_t>(20, two_periods_ms));
}

/// The share of its stroke by which the hand wants the handle to be away from the origin of D.
double share_of_stroke(double t_s) noexcept {
  const double phase_s = std::fmod(t_s, kCycle_s);
  const double down = (phase_s - kRest_s) / kDown_s;
  const double up = (kCycle_s - phase_s) / kUp_s;
  const double share = std::clamp(std::min(down, up), 0.0, 1.0);
  return share * share * (3.0 - 2.0 * share);  // comes and goes without a jerk
}

/// From orientation `a` to `b` within `step_s`, in D axes, for turns that are small.
std::array<double, 3> turn_between(const std::array<double, 4>& a, const std::array<double, 4>& b,
                                   double step_s) noexcept {
  // Vector part of b times the conjugate of a, with the sign of the shorter way.
  const double w = b[3] * a[3] + b[0] * a[0] + b[1] * a[1] + b[2] * a[2];
  const double scale = (w < 0 ? -2.0 : 2.0) / step_s;
  return {scale * (-b[3] * a[0] + b[0] * a[3] - b[1] * a[2] + b[2] * a[1]),
          scale * (-b[3] * a[1] + b[1] * a[3] - b[2] * a[0] + b[0] * a[2]),
          scale * (-b[3] * a[2] + b[2] * a[3] - b[0] * a[1] + b[1] * a[0])};
}

}  // namespace

DeviceParameters held_peer(double late_s) noexcept {
  DeviceParameters d{};
  d.given = 1;
  d.mass_kg = kMass_kg;
  d.damping_ns_per_m = kDamping_ns_per_m + kHandDamping_ns_per_m;
  d.delay_s = late_s;
  return d;
}

HandWish PressingHand::wish(double t_s) noexcept {
  HandWish wish;
  const double share = share_of_stroke(t_s);
  for (std::size_t k = 0; k < 3; ++k) wish.position_m[k] = share * stroke_m_[k];
  wish.deadman = std::fmod(t_s, kCycle_s) >= 0.5 * kRest_s;
  return wish;
}

hal::HalStatus SimulatedPeer::plug(std::int64_t now_ns) noexcept {
  *this = SimulatedPeer(settings_, *hand_);
  due_ns_ = now_ns + settings_.period_ns;
  return hal::HalStatus::kOk;
}

hal::HalStatus SimulatedPeer::control(const hal::ControlRequest& request,
                                      std::span<std::uint8_t> bytes, std::size_t& moved) noexcept {
  moved = 0;
  if (request.request_type != hal::kReferenceBlockRequestType ||
      request.request != hal::kReferenceBlockRequest || bytes.size() < hal::kReferenceBlockBytes)
    return hal::HalStatus::kTransferFailed;  // as a stall
  hal::ReferenceBlock block;
  block.report_period_us = static_cast<std::uint16_t>(settings_.period_ns / 1000);
  block.watchdog_ms = watchdog_ms(settings_.period_ns);
  block.mass_mg = static_cast<std::uint32_t>(kMass_kg * 1e6);
  block.damping_uns_per_m = static_cast<std::uint32_t>(kDamping_ns_per_m * 1e6);
  hal::encode(block, bytes.first<hal::kReferenceBlockBytes>());
  moved = hal::kReferenceBlockBytes;
  return hal::HalStatus::kOk;
}

void SimulatedPeer::pass_period() noexcept {
  const double step_s = 1e-9 * static_cast<double>(settings_.period_ns);
  periods_ += 1;
  sequence_ += 1;
  const HandWish before = std::exchange(wish_, hand_->wish(static_cast<double>(periods_) * step_s));
  turn_rad_per_s_ = turn_between(before.q_xyzw, wish_.q_xyzw, step_s);
  for (std::size_t k = 0; k < 3; ++k) {
    const double hand_n = kHandSpring_n_per_m * (wish_.position_m[k] - position_m_[k]) -
                          (kHandDamping_ns_per_m + kDamping_ns_per_m) * velocity_m_per_s_[k];
    const double drive_n = drives_on_ ? force_n_[k] : 0.0;
    velocity_m_per_s_[k] += step_s * (hand_n + drive_n) / kMass_kg;
    position_m_[k] += step_s * velocity_m_per_s_[k];
  }
  const double silence_s = static_cast<double>(periods_ - fed_) * step_s;
  if (!drives_on_ || silence_s < 1e-3 * watchdog_ms(settings_.period_ns)) return;
  drives_on_ = false;
  cut_ = true;
  counters_.watchdog_cuts += 1;
}

std::size_t SimulatedPeer::report(std::int64_t now_ns, std::span<std::uint8_t> bytes,
                                  std::int64_t& /*sampled_ns*/) noexcept {
  if (now_ns < due_ns_ || bytes.size() < hal::kReferenceReportBytes) return 0;
  for (int k = 0; k < kMostPeriods && due_ns_ <= now_ns; ++k) {
    pass_period();
    due_ns_ += settings_.period_ns;
  }
  // Where its host was away for longer, its time stood still.
  if (due_ns_ <= now_ns) due_ns_ = now_ns + settings_.period_ns;

  hal::ReferenceReport r;
  r.status = hal::kReferenceCalibrated | hal::kReferenceTwistValid;
  if (drives_on_) r.status |= hal::kReferenceDrivesOn;
  if (cut_) r.status |= hal::kReferenceWatchdogCut;
  r.sequence = sequence_;
  r.time_us = periods_ * static_cast<std::uint64_t>(settings_.period_ns) / 1000;
  for (std::size_t k = 0; k < 3; ++k) {
    r.position[k] = units(position_m_[k], hal::kReferencePositionUnit_m);
    r.velocity[k] = units(velocity_m_per_s_[k], hal::kReferenceVelocityUnit_m_per_s);
    r.angular_velocity[k] = units(turn_rad_per_s_[k], hal::kReferenceTurnUnit_rad_per_s);
  }
  for (std::size_t k = 0; k < 4; ++k)
    r.orientation[k] = units(wish_.q_xyzw[k], hal::kReferenceOrientationUnit);
  r.switches = wish_.deadman ? settings_.deadman : 0;
  r.faults = cut_ ? std::uint32_t{kDeviceWatchdogCut} : 0u;
  r.accepted_tick = tick_;
  r.rejected = static_cast<std::uint32_t>(counters_.refused);
  r.accepted_sequence = accepted_;
  hal::encode(r, bytes.first<hal::kReferenceReportBytes>());
  return hal::kReferenceReportBytes;
}

void SimulatedPeer::command(std::int64_t /*now_ns*/, std::span<const std::uint8_t> bytes) noexcept {
  hal::ReferenceCommand c;
  counters_.commands += 1;
  if (hal::decode(bytes, c) != hal::CodecVerdict::kOk || !hal::is_newer(c.sequence, accepted_)) {
    counters_.refused += 1;
    return;
  }
  accepted_ = c.sequence;
  tick_ = c.tick;
  fed_ = periods_;
  if (!c.drives_on) {
    if (drives_on_) counters_.released += 1;
    drives_on_ = fresh_ = cut_ = false;
  } else if (!cut_ && !fresh_) {
    drives_on_ = true;
    for (std::size_t k = 0; k < 3; ++k) force_n_[k] = c.force[k] * hal::kReferenceForceUnit_n;
  }
}

}  // namespace haptic::tools
