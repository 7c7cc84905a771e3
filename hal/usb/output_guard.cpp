// SPDX-License-Identifier: Apache-2.0
#include "hal/usb/output_guard.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/base/stamp.hpp"

namespace haptic::hal {
namespace {

constexpr std::uint64_t kEndless_ns = std::numeric_limits<std::uint64_t>::max();

std::uint64_t span_ns(std::int64_t from_ns, std::int64_t to_ns) noexcept {
  return static_cast<std::uint64_t>(to_ns) - static_cast<std::uint64_t>(from_ns);
}

// `v` made shorter, in its direction, until it is within the norm and every axis limit that is not
// zero. By its shape, since the norm of a finite vector need not be finite.
Vec3 within(const Vec3& v, Real norm_limit, const Vec3& axis_limit) noexcept {
  const Real largest = v.cwiseAbs().maxCoeff();
  if (!(largest > 0.0_r)) return Vec3::Zero();
  const Vec3 shape = v / largest;
  Real size = std::min(largest, norm_limit / shape.norm());
  for (int k = 0; k < 3; ++k) {
    if (axis_limit[k] > 0.0_r) size = std::min(size, axis_limit[k] / std::abs(shape[k]));
  }
  return size == largest ? v : Vec3(size * shape);
}

// From `last` towards `wanted` by at most `most`; both lie in one convex set, and so does the
// result. Towards zero no component grows.
Vec3 slewed(const Vec3& last, const Vec3& wanted, Real most) noexcept {
  const Vec3 change = wanted - last;
  const Real size = robust_length(change);
  return size > most ? Vec3(last + (most / size) * change) : wanted;
}

}  // namespace

OutputGuard::OutputGuard(const SafetyLimits& limits) noexcept : own_(usable(limits)) {
  limit(own_);
}

void OutputGuard::limit(const SafetyLimits& connection) noexcept {
  limits_ = tighter(own_, connection);
  WrenchRampLimits ramp;
  ramp.slew_n_per_s = limits_.slew_n_per_s;
  ramp.slew_nm_per_s = limits_.slew_nm_per_s;
  ramp.ramp_in_s = limits_.ramp_in_s;
  output_.ramp = WrenchRamp(ramp);
  restart();
}

bool OutputGuard::runs_ahead_of(const Wrench& device_d) const noexcept {
  constexpr Real kSlack = 1.0e-6_r;  // of what a driver rounds
  const Real longest_s = longest_step_s(period_of_sends_ns());
  const auto runs = [longest_s](const Vec3& device, const Vec3& before, const Vec3& now,
                                Real slew_per_s) {
    const Real ahead = robust_length(now - device);
    return ahead > slew_per_s * longest_s * (1 + kSlack) + kSlack &&
           ahead > robust_length(before - device);
  };
  const Wrench& now_d = output_.sent_d;
  const Wrench& before_d = before_.sent_d;
  return runs(device_d.force_w, before_d.force_w, now_d.force_w, limits_.slew_n_per_s) ||
         runs(device_d.torque_w, before_d.torque_w, now_d.torque_w, limits_.slew_nm_per_s);
}

void OutputGuard::latch(std::uint32_t faults) noexcept {
  faults_ |= faults;
  blocked_ = true;
  blocked_at_ = arming_;
}

void OutputGuard::hold_back(const DeviceCommand& newest) noexcept {
  follow_arming(newest);
  latch(0);
}

void OutputGuard::restart() noexcept {
  output_.ramp.reset(false);
  output_.sent_d = Wrench{};
  output_.stamped = false;
  before_ = output_;
  blocked_ = true;
  blocked_at_ = arming_;
}

void OutputGuard::follow_arming(const DeviceCommand& command) noexcept {
  if (command.tick == 0) return;
  if (command.tick < tick_) {  // a new servo process counts its ticks and its armings from zero
    arming_ = command.arming;
    latch(kLinkServoLost);
  }
  tick_ = command.tick;
  arming_ = command.arming;
  if (blocked_ && arming_ > blocked_at_) {
    blocked_ = false;
    faults_ = 0;
  }
}

std::int64_t OutputGuard::period_of_sends_ns() const noexcept {
  return report_period_ns_ > 0 ? std::min(report_period_ns_, limits_.period_ns) : limits_.period_ns;
}

// The newest command that could be used. One that lies more than the held periods in the future
// is no sign of life: its age would not grow for as long.
std::uint64_t OutputGuard::command_age_ns(std::int64_t now_ns,
                                          const DeviceCommand& command) noexcept {
  if (command.tick == 0) return kEndless_ns;
  if (is_finite(wrench_of(command.wrench_d))) {
    finite_stamp_ns_ = command.stamp_ns;
    finite_seen_ = true;
  }
  if (!finite_seen_) return kEndless_ns;
  if (now_ns >= finite_stamp_ns_) return span_ns(finite_stamp_ns_, now_ns);
  const auto slack = static_cast<std::uint64_t>(limits_.period_ns) * (1 + limits_.held_periods);
  return span_ns(now_ns, finite_stamp_ns_) <= slack ? 0 : kEndless_ns;
}

GuardedOutput OutputGuard::update(std::int64_t now_ns, const DeviceCommand& command) noexcept {
  follow_arming(command);
  const std::uint64_t age_ns = command_age_ns(now_ns, command);
  const auto period_ns = static_cast<std::uint64_t>(limits_.period_ns);
  // A command is up to a period old in normal running: as in the servo tick, that one passes.
  const bool late = age_ns > period_ns * (1 + limits_.held_periods);
  GuardedOutput result;
  result.tick = tick_;
  if (command.tick != 0 && age_ns > period_ns * (1 + limits_.lost_periods)) {
    latch(kLinkStaleCommand);
    result.present = kLinkStaleCommand;
  }

  before_ = output_;
  const Real longest_s = longest_step_s(period_of_sends_ns());
  Real elapsed_s = output_.stamped ? seconds_between(output_.stamp_ns, now_ns) : 0.0_r;
  if (elapsed_s > longest_s) elapsed_s = longest_s;
  output_.stamp_ns = now_ns;
  output_.stamped = true;

  const Wrench given_d = wrench_of(command.wrench_d);
  Wrench wanted_d;
  if (late || !is_finite(given_d)) {
    result.held = !blocked_;
    const Real periods = elapsed_s * 1.0e9_r / static_cast<Real>(limits_.period_ns);
    const Real share = std::pow(limits_.decay_per_period, periods);
    wanted_d = {share * output_.sent_d.force_w, share * output_.sent_d.torque_w};
  } else {
    const Wrench driven_d = project_wrench(given_d, limits_.driven_dof);
    wanted_d.force_w = within(driven_d.force_w, limits_.max_force_n, limits_.max_axis_force_n);
    wanted_d.torque_w =
        within(driven_d.torque_w, limits_.max_torque_nm, limits_.max_axis_torque_nm);
  }

  Wrench target_d;
  if (blocked_) {
    output_.ramp.reset(false);
  } else {
    output_.ramp.ramp_in();
    target_d = output_.ramp.update(now_ns, wanted_d).wrench_w;
  }
  // This bounds the change, no matter what the stages before computed.
  Wrench& sent_d = output_.sent_d;
  sent_d.force_w = slewed(sent_d.force_w, target_d.force_w, limits_.slew_n_per_s * elapsed_s);
  sent_d.torque_w = slewed(sent_d.torque_w, target_d.torque_w, limits_.slew_nm_per_s * elapsed_s);
  result.wrench_d = sent_d;
  result.faults = faults_;
  return result;
}

}  // namespace haptic::hal
