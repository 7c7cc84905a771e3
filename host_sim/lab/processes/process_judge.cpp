// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/processes/process_judge.hpp"

#include <algorithm>
#include <string>

namespace haptic::sim {
namespace {

// Longest time from a fault to zero: what is stated for the servo (its hang is noticed after five
// periods), and an allowance for a machine that does other things as well.
constexpr double kRampWithin_ms = 150, kZeroWithin_ms = 100;

/// What the wire says.
void measure(ProcessVerdict& v, double slew_n_per_s) {
  ProcessFigures& f = v.found;
  const double period_s = 1e-3;
  const double allowed_n = 2 * period_s * slew_n_per_s + kWireRounding_n;
  const ProcessOutput output = v.cell.fault->output;
  const WireCommand* last = nullptr;
  double least_n = f.before_n;
  for (const WireCommand& c : v.wire.commands) {
    const double now_n = c.drives_on ? c.wrench.force_w.norm() : 0;
    const bool after = c.stamp_ns >= v.fault_ns;
    if (last != nullptr && last->host == c.host && after) {
      const double last_n = last->drives_on ? last->wrench.force_w.norm() : 0;
      const double step_n = c.drives_on || !last->drives_on
                                ? (c.wrench.force_w - last->wrench.force_w).norm()
                                : last_n;
      const bool zero_at_once = output == ProcessOutput::kZeroAtOnce && now_n == 0;
      if (!zero_at_once) f.largest_step_n = std::max(f.largest_step_n, step_n);
    }
    if (after) f.largest_n = std::max(f.largest_n, now_n);
    if (after && c.host == 1) {
      f.rise_n = std::max(f.rise_n, now_n - least_n);
      least_n = std::min(least_n, now_n);
    }
    last = &c;
  }
  f.step_share = f.largest_step_n / allowed_n;
  for (const WirePeriod& p : v.wire.periods) {
    if (p.stamp_ns < v.fault_ns || p.stamp_ns > v.fault_ns + kProcessWatch_ns) continue;
    f.largest_late_ms = std::max(f.largest_late_ms, 1e-6 * static_cast<double>(p.late_ns));
    if (p.acting_n > kWireRounding_n)
      f.above_zero_ms = 1e-6 * static_cast<double>(p.stamp_ns - v.fault_ns);
  }
}

void judge(ProcessVerdict& v) {
  const ProcessFigures& f = v.found;
  const auto fail = [&v](const std::string& text) { v.failures.push_back(text); };
  const OperatorState state = v.cell.state;
  const bool forced = f.before_n > kWireRounding_n;
  if (f.step_share > 1) {
    fail("a step of " + fixed(f.largest_step_n, 2) + " N from one command to the next");
  }
  if (v.cell.fault->output == ProcessOutput::kGoesOn) {
    const bool steady = state == OperatorState::kArmedContact;
    if (steady && f.after_n < 0.8 * f.before_n)
      fail("the force went from " + fixed(f.before_n, 2) + " to " + fixed(f.after_n, 2) + " N");
  } else if (v.cell.fault->output == ProcessOutput::kBounded) {
    if (f.largest_n > kProcessDevice_n + kWireRounding_n)
      fail("a force of " + fixed(f.largest_n, 2) + " N");
  } else if (forced) {
    const bool ramps = v.cell.fault->output == ProcessOutput::kRampsToZero;
    const double within_ms = ramps ? kRampWithin_ms : kZeroWithin_ms;
    if (f.above_zero_ms > within_ms) fail("a force for " + fixed(f.above_zero_ms, 0) + " ms");
    // One command that was under way when the fault came.
    const bool grows = state == OperatorState::kArming;
    if (!grows && f.rise_n > 0.05) fail("the force rose by " + fixed(f.rise_n, 2) + " N");
  }
  const bool none = state == OperatorState::kDisarmed || state == OperatorState::kFaulted;
  if (none && (f.before_n > 0 || f.rise_n > 0)) fail("a force though nothing is armed");
}

}  // namespace

void judge_wire(ProcessVerdict& verdict, double slew_n_per_s) {
  measure(verdict, slew_n_per_s);
  judge(verdict);
}

}  // namespace haptic::sim
