// SPDX-License-Identifier: Apache-2.0
#include "tests/support/force_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "rt_core/base/stamp.hpp"

namespace haptic::test {
namespace {

// Of the time in which the slew brings the largest output down.
constexpr Real kMostReleaseTimes = 2.0_r;
constexpr std::int64_t kReleaseSteps = 2;
// Of the arithmetic on the way, relative to the largest output.
constexpr Real kRounding = sizeof(Real) == sizeof(double) ? 1.0e-12_r : 1.0e-5_r;

std::string named(const char* rule, const char* what, Real is, Real most) {
  char text[160];
  std::snprintf(text, sizeof text, "%s: %s %.9g, at most %.9g", rule, what, static_cast<double>(is),
                static_cast<double>(most));
  return text;
}

/// Force or torque.
struct Half {
  const char* name;
  Vec3 now, last;
  Real largest;
  Vec3 axes;
  Real slew_per_s, unit;
};

std::string beyond_block(const Half& h, Real slack) {
  if (h.now.norm() > h.largest + slack)
    return named("beyond the device's block", h.name, h.now.norm(), h.largest);
  for (int k = 0; k < 3; ++k) {
    if (h.axes[k] > 0 && std::abs(h.now[k]) > h.axes[k] + slack)
      return named("beyond the device's axis", h.name, std::abs(h.now[k]), h.axes[k]);
  }
  return {};
}

std::string grown(const char* rule, const Half& h, Real slack) {
  for (int k = 0; k < 3; ++k) {
    const bool turned = h.now[k] * h.last[k] < 0 && std::abs(h.now[k]) > slack;
    if (turned || std::abs(h.now[k]) > std::abs(h.last[k]) + slack)
      return named(rule, h.name, h.now[k], h.last[k]);
  }
  return {};
}

}  // namespace

ForceBlock ForceBlock::of(const hal::DeviceCapabilities& c, const SafetyLimits& limits) {
  const auto known = [](Real own, Real otherwise) { return own > 0 ? own : otherwise; };
  ForceBlock block;
  block.max_force_n = known(c.max_force_n, limits.max_force_n);
  block.max_torque_nm = known(c.max_torque_nm, limits.max_torque_nm);
  block.max_axis_force_n = c.max_axis_force_n;
  block.max_axis_torque_nm = c.max_axis_torque_nm;
  block.slew_n_per_s =
      std::min(limits.slew_n_per_s, known(c.max_force_rate_n_per_s, limits.slew_n_per_s));
  block.slew_nm_per_s =
      std::min(limits.slew_nm_per_s, known(c.max_torque_rate_nm_per_s, limits.slew_nm_per_s));
  constexpr std::int64_t kMostPeriods = 2, kLongest_ns = 5'000'000;
  const std::int64_t period_ns =
      c.report_period_ns > 0 ? std::min(c.report_period_ns, limits.period_ns) : limits.period_ns;
  block.longest_step_ns = std::min(kMostPeriods * period_ns, kLongest_ns);
  return block;
}

std::string ForceMonitor::on_send(const SentCommand& sent) {
  const Real since_s = last_.stamped ? seconds_between(last_.stamp_ns, sent.stamp_ns) : 0.0_r;
  const Real counted_s = std::min(since_s, seconds_between(0, block_.longest_step_ns));
  const Real blocked_s = sent.blocked ? last_.blocked_s + counted_s : 0.0_r;
  std::string broken = change(sent, counted_s);
  if (broken.empty()) broken = release(sent, blocked_s);
  if (sent.drives_on && !sent.ready) broken = "drives are asked for while the device is not ready";
  if (!is_finite(sent.wrench_d)) broken = "a number is not finite";
  before_ = last_;
  last_ = {sent.wrench_d, sent.stamp_ns, true, blocked_s};
  return broken;
}

// At half the slew from the largest output there is none left.
std::string ForceMonitor::release(const SentCommand& sent, Real blocked_s) const {
  const Real force_s = block_.max_force_n / block_.slew_n_per_s;
  const Real torque_s = block_.max_torque_nm / block_.slew_nm_per_s;
  const Real longest_s = kMostReleaseTimes * std::max(force_s, torque_s) +
                         seconds_between(0, kReleaseSteps * block_.longest_step_ns);
  const bool gone = sent.wrench_d.force_w.norm() <= block_.force_unit_n + sent.rounding_n &&
                    sent.wrench_d.torque_w.norm() <= block_.torque_unit_nm;
  return gone || blocked_s <= longest_s
             ? std::string()
             : named("stays on while blocked", "time [s]", blocked_s, longest_s);
}

std::string ForceMonitor::change(const SentCommand& sent, Real counted_s) const {
  const Half halves[] = {
      {"force [N]", sent.wrench_d.force_w, last_.wrench_d.force_w, block_.max_force_n,
       block_.max_axis_force_n, block_.slew_n_per_s, block_.force_unit_n + sent.rounding_n},
      {"torque [N m]", sent.wrench_d.torque_w, last_.wrench_d.torque_w, block_.max_torque_nm,
       block_.max_axis_torque_nm, block_.slew_nm_per_s, block_.torque_unit_nm}};
  for (const Half& h : halves) {
    const Real slack = h.unit + kRounding * h.largest;
    if (std::string broken = beyond_block(h, slack); !broken.empty()) return broken;
    if (sent.blocked) {
      if (std::string broken = grown("grows while blocked", h, slack); !broken.empty())
        return broken;
    }
    if (sent.fading) {
      if (std::string broken = grown("grows without a command", h, slack); !broken.empty())
        return broken;
    }
    const Real step = (h.now - h.last).norm(), most = h.slew_per_s * counted_s;
    if (sent.cut && grown("", h, slack).empty()) continue;
    if (step > most + slack) return named("steps by more than its slew", h.name, step, most);
  }
  return {};
}

}  // namespace haptic::test
