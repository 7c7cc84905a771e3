// SPDX-License-Identifier: Apache-2.0
// The servo process dies while a hand presses a cube into a wall near the device's full force: what
// the device is handed from then on, and what it does.
//
// These cases run in real time on a machine that may be busy with other things. What is exact is
// asked for exactly: every step of the force by the time between two outputs, and that it never
// rises again. How long it takes is bounded by kFall_ms, far beyond the stated time. Where ticks
// come so late that the servo lets go by itself, the operator presses again (HeldDevice::press);
// where a process dies at such a moment, the scenario has not happened and is repeated, three times
// at most, which is said.
#include <doctest/doctest.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hal/clock/servo_clock.hpp"
#include "hal/realtime/flight_report.hpp"
#include "rt_core/safety/wrench_ramp.hpp"
#include "tests/host_sim/held_device.hpp"
#include "tests/support/signal_process.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

using Sent = std::span<const SentCommand>;

constexpr int kTries = 3;
constexpr double kFall_ms = 500;  // allowance for a machine that does other things as well
constexpr double kNearFull_n = 0.9 * kFullForce_n;
// Half a unit of the protocol for each component, twice.
const double kRounding_n = std::sqrt(3.0) * hal::kReferenceForceUnit_n;
const double kRounding_nm = std::sqrt(3.0) * hal::kReferenceTorqueUnit_nm;

/// Time after which the force is zero where nothing is late: the command counts as lost, an output
/// more is due, and the ramp.
double stated_fall_ms(const SafetyLimits& limits) {
  const double period_ms = 1e-6 * static_cast<double>(limits.period_ns);
  return period_ms * (limits.lost_periods + 2) + 1e3 * static_cast<double>(longest_ramp_s(limits));
}

/// Index of the command from which on the force only falls.
using Onset = std::size_t (*)(Sent sent);

/// The first that rests on the last tick of the process at work.
std::size_t last_tick(Sent sent) {
  std::size_t first = sent.size() - 1;
  while (first > 0 && sent[first - 1].tick == sent[first].tick) --first;
  return first;
}

/// The last one near full force: at an orderly stop the process may tick once more in the ramp.
std::size_t last_full(Sent sent) {
  std::size_t last = sent.size() - 1;
  while (last > 0 && sent[last].force_n.norm() < kNearFull_n) --last;
  return last;
}

/// Every step of everything that was handed over, by the time since the one before.
void check_steps(const HeldDevice& held) {
  const Sent sent = held.sent();
  std::size_t worst = 0, jumps = 0;
  double largest_n = 0;
  for (std::size_t k = 1; k < sent.size(); ++k) {
    const double elapsed_s =
        std::min(1e-9 * static_cast<double>(sent[k].stamp_ns - sent[k - 1].stamp_ns),
                 static_cast<double>(longest_step_s(held.limits().period_ns)));
    const double step_n = (sent[k].force_n - sent[k - 1].force_n).norm();
    const double step_nm = (sent[k].torque_nm - sent[k - 1].torque_nm).norm();
    const bool fits =
        step_n <= elapsed_s * static_cast<double>(held.limits().slew_n_per_s) + kRounding_n &&
        step_nm <= elapsed_s * static_cast<double>(held.limits().slew_nm_per_s) + kRounding_nm;
    // After its own cut the device has no force that a step could start from.
    if (!fits && sent[k].drives_on) {
      ++jumps;
      worst = k;
    }
    largest_n = std::max(largest_n, step_n);
  }
  CAPTURE(worst);
  CHECK(jumps == 0);
  CHECK(largest_n > 0);
}

/// Cuts by the device's watchdog until then: a holder that was not let run for as long is one, too.
std::uint32_t cuts_until(const HeldDevice& held, std::int64_t wall_ns) {
  std::uint32_t cuts = 0;
  for (const DevicePeriod& period : held.periods())
    if (period.wall_ns <= wall_ns) cuts = period.cuts;
  return cuts;
}

/// The device did what it was handed, in that order, wherever its drives were on.
void check_device(const HeldDevice& held) {
  const Sent sent = held.sent();
  std::size_t at = 0, unknown = 0;
  for (const DevicePeriod& period : held.periods()) {
    if (!period.drives_on) continue;
    std::size_t next = at;
    while (next < sent.size() && (sent[next].force_n - period.force_n).norm() > 1e-9) ++next;
    next == sent.size() ? ++unknown : at = next;
  }
  CHECK(unknown == 0);
  CHECK(at > 0);
}

struct Fall {
  bool cut = false;       ///< by the device's own watchdog, before the ramp had come to its end
  double zero_ms = -1;    ///< from the kill to the first zero, of the host or of the device
  std::size_t steps = 0;  ///< outputs until then
};

/// From `onset` on: falls to zero and never rises.
Fall check_fall(const HeldDevice& held, std::int64_t killed_ns, Onset onset) {
  const Sent sent = held.sent();
  const std::size_t from = onset(sent);
  Fall fall;
  std::size_t rises = 0;
  REQUIRE(sent[from].force_n.norm() >= kNearFull_n);
  for (std::size_t k = from + 1; k < sent.size(); ++k) {
    if (sent[k].force_n.norm() > sent[k - 1].force_n.norm()) ++rises;
    if (sent[k].torque_nm.norm() > sent[k - 1].torque_nm.norm()) ++rises;
    if (fall.zero_ms >= 0) continue;
    ++fall.steps;
    if (sent[k].force_n.norm() == 0)
      fall.zero_ms = 1e-6 * static_cast<double>(sent[k].stamp_ns - killed_ns);
  }
  CHECK(rises == 0);
  CHECK(fall.zero_ms >= 0);
  CHECK(sent.back().force_n.norm() == 0);
  CHECK(sent.back().torque_nm.norm() == 0);

  // At the device: a period is noted after the next command may have come, so the first two after
  // the last command may still show the ones before it.
  std::size_t after = 0;
  double last_n = 0;
  bool cut = false;
  const std::uint32_t cuts_before = cuts_until(held, killed_ns);
  for (const DevicePeriod& period : held.periods()) {
    if (period.wall_ns <= sent[from].stamp_ns) continue;
    const double force_n = period.force_n.norm();
    if (after++ > 1 && force_n > last_n) ++rises;
    last_n = force_n;
    if (period.cuts == cuts_before || cut) continue;
    cut = true;
    CHECK(period.cuts == cuts_before + 1);
    const double cut_ms = 1e-6 * static_cast<double>(period.wall_ns - killed_ns);
    fall.cut = cut_ms < fall.zero_ms;
    if (fall.cut) fall.zero_ms = cut_ms;
  }
  CHECK(rises == 0);
  CHECK(after > 100);
  CHECK(last_n == 0);
  CHECK(fall.zero_ms < kFall_ms);
  return fall;
}

void tell(const std::string& what, const HeldDevice& held, const Fall& fall) {
  MESSAGE(what << ": zero after " << fall.zero_ms << " ms in " << fall.steps << " outputs ("
               << std::string(fall.cut ? "the device's own watchdog cut first" : "ramp")
               << "; stated " << stated_fall_ms(held.limits())
               << " ms on a machine that has the time), presses " << held.presses());
}

/// Waits for the end of the process at work. False: no news of it.
bool servo_ends(HeldDevice& held) {
  const std::int64_t end_ns = hal::monotonic_ns() + 10'000'000'000;
  while (hal::monotonic_ns() < end_ns) {
    if (held.guardian().wait(100) == hal::GuardianNews::kServoEnded) return true;
  }
  return false;
}

/// Presses, does `harm`, and lets 200 periods pass; again where the servo had let go by itself.
/// @return nothing where the scenario did not happen in kTries.
std::unique_ptr<HeldDevice> harmed(unsigned spares, Onset onset,
                                   const std::function<void(HeldDevice&)>& harm,
                                   std::int64_t& harmed_ns) {
  for (int k = 0; k < kTries; ++k) {
    auto held = std::make_unique<HeldDevice>(spares);
    if (held->press()) {
      harmed_ns = hal::monotonic_ns();
      harm(*held);
      REQUIRE(held->pass(200));
      if (held->sent()[onset(held->sent())].force_n.norm() >= kNearFull_n) return held;
    }
    MESSAGE("try " << k + 1 << " of " << kTries << ": ticks too late, the force was let go before");
  }
  return nullptr;
}

/// Flight records of a dead process: without a gap, to the last tick that it reported.
void check_flight(HeldDevice& held, const std::vector<StepTrace>& records) {
  REQUIRE(records.size() > 2 * kHashEvery);
  const StepTrace &first = records.front(), &last = records.back();
  for (std::size_t k = 1; k < records.size(); ++k)
    REQUIRE(records[k].tick == records[k - 1].tick + 1);
  std::size_t compared = 0;
  for (const HashNote& note : held.hash_notes()) {
    if (note.tick < first.tick) continue;
    REQUIRE(note.tick <= last.tick);
    CHECK(records[note.tick - first.tick].state_hash == note.hash);
    ++compared;
  }
  const std::size_t due = last.tick / kHashEvery - (first.tick - 1) / kHashEvery;
  // A kill may come between the last record and its note.
  const bool untold = last.tick % kHashEvery == 0 && compared + 1 == due;
  CHECK((compared == due || untold));
  CHECK(compared > 2);
}

/// The spare at work renders nothing until the operator has released and pressed again.
void check_takes_over(HeldDevice& held) {
  const std::size_t before = held.sent().size();
  const std::uint64_t last = held.sent().back().tick;
  REQUIRE(held.guardian().take_over());
  CHECK(held.guardian().number() == 1);
  REQUIRE(held.pass(300));  // the hand holds the deadman and presses, as before
  std::size_t of_new = 0, not_zero = 0;
  for (const SentCommand& sent : held.sent().subspan(before)) {
    if (sent.force_n.norm() + sent.torque_nm.norm() > 0) ++not_zero;
    if (sent.tick < last) ++of_new;
  }
  CHECK(of_new > 50);
  CHECK(not_zero == 0);
  CHECK((held.sent().back().faults & kLinkServoLost) != 0);
  REQUIRE_FALSE(held.guardian().flight().empty());
  CHECK(held.guardian().flight().front().tick == 1);
  // Released and pressed: force as before.
  REQUIRE(held.press());
}

}  // namespace

#if defined(__SANITIZE_ADDRESS__)
/// The crash that a test makes ends its process by the signal, not by a sanitizer's report.
extern "C" const char* __asan_default_options() { return "handle_segv=0"; }
#endif

TEST_SUITE("host_sim.servo_process") {
  TEST_CASE(
      "killed: the force ramps to zero; a spare takes over, without force until armed again") {
    std::int64_t killed_ns = 0;
    const auto kill_servo = [](HeldDevice& h) {
      signal_process(h.guardian().pid(), SIGKILL);
      CHECK(servo_ends(h));
    };
    const auto held = harmed(1, last_tick, kill_servo, killed_ns);
    REQUIRE(held != nullptr);
    CHECK(hal::to_text(held->guardian().servo_end().end) == "killed by signal 9 (Killed)");
    tell("SIGKILL", *held, check_fall(*held, killed_ns, last_tick));
    CHECK((held->sent().back().faults & kLinkServoLost) != 0);
    check_steps(*held);
    check_device(*held);
    check_flight(*held, held->guardian().servo_end().records[0]);

    check_takes_over(*held);
    CHECK_FALSE(held->guardian().take_over());  // it has not ended
    CHECK(held->guardian().stop());
    CHECK(held->sent().back().force_n.norm() == 0);
    check_steps(*held);
  }

  TEST_CASE("fault: the last record is the tick before it, with the hashes that were reported") {
    std::int64_t crashed_ns = 0;
    const auto crash = [](HeldDevice& h) {
      h.crash_servo();
      CHECK(servo_ends(h));
    };
    const auto held = harmed(0, last_tick, crash, crashed_ns);
    REQUIRE(held != nullptr);
    const hal::ServoEnd& end = held->guardian().servo_end();
    CHECK(end.end.signal == SIGSEGV);
    tell("SIGSEGV", *held, check_fall(*held, crashed_ns, last_tick));
    check_steps(*held);
    check_device(*held);
    check_flight(*held, end.records[0]);
    // In the tick of the fault it said nothing any more: what was handed over last is the record's.
    const SentCommand& last = held->sent()[last_tick(held->sent())];
    CHECK(end.records[0].back().tick == last.tick);
    const double* force = end.records[0].back().command_force_n;
    CHECK((sim::Vector(force[0], force[1], force[2]) - last.force_n).norm() < 2 * kRounding_n);
    CHECK(hal::flight_text(end.records[0], 5).find(" armed ") != std::string::npos);
    CHECK_FALSE(held->guardian().take_over());  // there is no spare
    CHECK(held->guardian().stop());
  }

  TEST_CASE("frozen: stale commands ramp the force down; at the stop the process is killed") {
    std::int64_t frozen_ns = 0;
    const auto freeze = [](HeldDevice& h) { signal_process(h.guardian().pid(), SIGSTOP); };
    const auto held = harmed(0, last_tick, freeze, frozen_ns);
    REQUIRE(held != nullptr);
    tell("SIGSTOP", *held, check_fall(*held, frozen_ns, last_tick));
    CHECK((held->sent().back().faults & kLinkStaleCommand) != 0);
    check_steps(*held);
    check_device(*held);
    CHECK(held->guardian().wait(0) == hal::GuardianNews::kNone);
    CHECK_FALSE(held->guardian().take_over());
    CHECK_FALSE(held->guardian().stop());
  }

  TEST_CASE("SIGTERM to the holder: ramp to zero, then the device is closed; exit code 0") {
    std::int64_t told_ns = 0;
    int code = -1;
    const auto terminate = [&code](HeldDevice& h) {
      signal_process(getpid(), SIGTERM);
      code = h.guardian().run([](const hal::ServoEnd&) { FAIL_CHECK("nothing ended"); });
    };
    const auto held = harmed(1, last_full, terminate, told_ns);
    REQUIRE(held != nullptr);
    CHECK(code == hal::kGuardianDone);
    CHECK(held->link().state() == LinkState::kAbsent);
    tell("SIGTERM", *held, check_fall(*held, told_ns, last_full));
    check_steps(*held);
    check_device(*held);
  }

  TEST_CASE("holder dead: the device's own watchdog cuts, once, after its time") {
    std::int64_t hung_ns = 0;
    const auto hang = [](HeldDevice& h) { h.hang_usb(true); };
    const auto held = harmed(0, last_tick, hang, hung_ns);
    REQUIRE(held != nullptr);
    const SentCommand last = held->sent().back();
    std::size_t acted = 0, changed = 0;
    for (const DevicePeriod& period : held->periods()) {
      if (period.wall_ns <= last.stamp_ns || period.force_n.norm() == 0) continue;
      // The first may still show the command before.
      if (acted++ > 0 && (period.force_n - last.force_n).norm() > 1e-9) ++changed;
    }
    CHECK(changed == 0);  // no step until the cut
    // 20 ms at 1 kHz; the note of a period and the command may cross at either end.
    CHECK(acted >= 19);
    CHECK(acted <= 22);
    CHECK(held->periods().back().force_n.norm() == 0);
    CHECK(held->periods().back().cuts == cuts_until(*held, hung_ns) + 1);
    MESSAGE("holder dead: the watchdog cut after " << acted << " periods of 1 ms");
  }

  TEST_CASE("run: a process that dies is reported and replaced; without a spare it is the end") {
    HeldDevice held(1);
    REQUIRE(held.pass(300));
    held.crash_servo();  // the spare, too, before its first tick
    std::vector<unsigned> told;
    const int code = held.guardian().run([&](const hal::ServoEnd& end) {
      told.push_back(end.number);
      CHECK(end.end.signal == SIGSEGV);
      CHECK(end.records[0].empty() == (end.number == 1));
    });
    CHECK(code == hal::kGuardianServoFailed);
    CHECK(told == std::vector<unsigned>{0, 1});
    CHECK(held.link().state() == LinkState::kAbsent);
  }

  TEST_CASE("run: a servo process that returns ends it, with its exit code") {
    for (const int code : {0, 4, 77}) {
      hal::DeviceGuardian guardian({});
      REQUIRE(guardian.start([code](const hal::ServoSeat&) { return code; }) == 0);
      CHECK(guardian.start([](const hal::ServoSeat&) { return 0; }) == EBUSY);
      int told = 0;
      CHECK(guardian.run([&told](const hal::ServoEnd& end) {
        ++told;
        CHECK(end.records[0].empty());
      }) == (code == 77 ? hal::kGuardianServoFailed : code));
      CHECK(told == 1);
    }
  }
}
