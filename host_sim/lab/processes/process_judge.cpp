// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/processes/process_judge.hpp"

#include <algorithm>
#include <iterator>
#include <string>

namespace haptic::sim {
namespace {

// Longest time from a fault to zero: what is stated for the servo (its hang is noticed after five
// periods), and an allowance for a machine that does other things as well.
constexpr double kRampWithin_ms = 150, kZeroWithin_ms = 100;

// Two periods, and the hop from who makes it to who looks at the clock.
constexpr double kOldestCommand_ms = 2.25, kNeverMade_ms = 1e6;
// A status is dated to a millisecond.
constexpr std::int64_t kStatusBefore_ns = 4'000'000, kStatusAfter_ns = 2'000'000;

/// Steps, rises and times of the wire.
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

/// How old each command is that changes the force at the device: since run_device made the newest
/// one of the same force. One that repeats what the device has is held, not delivered.
void date_commands(ProcessVerdict& v) {
  ProcessFigures& f = v.found;
  if (v.tapped.empty()) return;
  Vector last_n = Vector::Zero();
  for (const WireCommand& c : v.wire.commands) {
    const Vector now_n = c.drives_on ? c.wrench.force_w : Vector(Vector::Zero());
    const bool changes = (now_n - last_n).norm() > kWireRounding_n && now_n.norm() > 0;
    last_n = now_n;
    // The tap is there some time after the host, and follows a new one.
    if (!changes || c.host != 1 || c.stamp_ns < v.tapped.front().stamp_ns) continue;
    const auto end = std::upper_bound(
        v.tapped.begin(), v.tapped.end(), c.stamp_ns,
        [](std::int64_t stamp_ns, const TappedCommand& t) { return stamp_ns < t.stamp_ns; });
    const auto same =
        std::find_if(std::make_reverse_iterator(end), v.tapped.rend(), [&](const TappedCommand& t) {
          return (t.wrench.force_w - now_n).norm() <= kWireRounding_n;
        });
    const double age_ms = same == v.tapped.rend()
                              ? kNeverMade_ms
                              : 1e-6 * static_cast<double>(c.stamp_ns - same->stamp_ns);
    ++f.dated;
    f.oldest_ms = std::max(f.oldest_ms, age_ms);
    if (age_ms > kOldestCommand_ms) ++f.too_old;
  }
}

/// The force that a status states, against the least that acted on the hand about its time, and
/// against it by more than the largest command-to-command step there.
void compare_statuses(ProcessVerdict& v) {
  ProcessFigures& f = v.found;
  std::size_t period = 0, command = 0;
  for (const StatedForce& s : v.stated) {
    const std::int64_t from_ns = s.stamp_ns - kStatusBefore_ns,
                       to_ns = s.stamp_ns + kStatusAfter_ns;
    while (period < v.wire.periods.size() && v.wire.periods[period].stamp_ns < from_ns) ++period;
    double least_n = -1;
    for (std::size_t k = period; k < v.wire.periods.size() && v.wire.periods[k].stamp_ns <= to_ns;
         ++k)
      least_n =
          least_n < 0 ? v.wire.periods[k].acting_n : std::min(least_n, v.wire.periods[k].acting_n);
    if (least_n < 0) continue;
    while (command < v.wire.commands.size() && v.wire.commands[command].stamp_ns < from_ns)
      ++command;
    double step_n = 0;
    for (std::size_t k = std::max<std::size_t>(command, 1);
         k < v.wire.commands.size() && v.wire.commands[k].stamp_ns <= to_ns; ++k)
      step_n = std::max(
          step_n,
          (v.wire.commands[k].wrench.force_w - v.wire.commands[k - 1].wrench.force_w).norm());
    ++f.stated;
    f.understated_n = std::max(f.understated_n, least_n - step_n - s.force_n);
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
  if (f.too_old > 0) {
    fail(std::to_string(f.too_old) + " of " + std::to_string(f.dated) +
         " commands reached the device older than two periods, the oldest by " +
         fixed(f.oldest_ms, 1) + " ms");
  }
  if (f.understated_n > kWireRounding_n)
    fail("a status states " + fixed(f.understated_n, 2) + " N less than the device had");
  const bool none = state == OperatorState::kDisarmed || state == OperatorState::kFaulted;
  if (none && (f.before_n > 0 || f.rise_n > 0)) fail("a force though nothing is armed");
}

}  // namespace

void judge_wire(ProcessVerdict& verdict, double slew_n_per_s) {
  measure(verdict, slew_n_per_s);
  date_commands(verdict);
  compare_statuses(verdict);
  judge(verdict);
}

}  // namespace haptic::sim
