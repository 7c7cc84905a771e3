// SPDX-License-Identifier: Apache-2.0
// The whole stack, a minute of a peg in its hole: through libusb it has the bits that it has
// without.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/host_sim/peg_minute.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::test;

namespace {

constexpr std::size_t kMinute = 60'000;

/// A tick, and what became of its command.
struct StackBits {
  TickBits tick;
  std::array<double, 24> device{};  ///< handed over, acting, and how the device moved
  bool contact = false, inside = false, ran = false;
  double force_n = 0;

  friend bool operator==(const StackBits& l, const StackBits& r) {
    return l.tick == r.tick &&
           std::memcmp(l.device.data(), r.device.data(), sizeof l.device) == 0 && l.ran == r.ran;
  }
};

StackBits stack_bits_of(const StackTick& t) {
  StackBits bits;
  bits.tick = test::bits_of(t.state, t.servo);
  std::size_t n = 0;
  const auto add = [&](const Vector& v) {
    for (int k = 0; k < 3; ++k) bits.device[n++] = v[k];
  };
  add(t.handed_d.force_w.cast<double>());
  add(t.handed_d.torque_w.cast<double>());
  add(t.acting.force_w);
  add(t.acting.torque_w);
  add(t.device.x0_w);
  add(t.device.q_wa.vec());
  add(t.device.velocity_w);
  add(t.device.angular_velocity_w);
  bits.contact = t.servo.rendered_new && t.servo.rendered.situation != ContactSituation::kNone;
  bits.inside = t.servo.rendered.proxy_pose_wa.p_wa.z() < -5.0e-3_r;
  bits.ran = t.servo_ran;
  bits.force_n = static_cast<double>(t.handed_d.force_w.norm());
  return bits;
}

struct MinuteRun {
  std::vector<StackBits> ticks;
  std::uint32_t faults = 0, cuts = 0, armings = 0;
  hal::LinkCounters link;
};

MinuteRun run_minute(StackCarrier carrier, bool report_clocked, std::size_t ticks) {
  CoreSession session(peg_scene(), "peg");
  const StackSettings settings = peg_settings(carrier, report_clocked);
  DeviceStack stack(session, settings, scripted_hand(session, peg_motion(ticks), 1000));
  MinuteRun run;
  run.ticks.reserve(ticks);
  for (std::size_t k = 0; k < ticks; ++k) {
    const StackTick tick = stack.step();
    run.faults |= tick.servo.faults | tick.state.faults;
    run.cuts = tick.cuts;
    run.armings = tick.servo.command.arming;
    run.ticks.push_back(stack_bits_of(tick));
  }
  run.link = stack.link_counters();
  return run;
}

/// The first tick that differs; the number of ticks where none does.
std::size_t first_difference(const std::vector<StackBits>& a, const std::vector<StackBits>& b) {
  const auto [at, other] = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
  return static_cast<std::size_t>(at - a.begin());
}

void compare_minutes(bool report_clocked) {
  const MinuteRun direct = run_minute(StackCarrier::kDirect, report_clocked, kMinute);
  const MinuteRun usb = run_minute(StackCarrier::kUsb, report_clocked, kMinute);
  REQUIRE(direct.ticks.size() == kMinute);
  REQUIRE(usb.ticks.size() == kMinute);
  CHECK(first_difference(direct.ticks, usb.ticks) == kMinute);

  std::size_t contact = 0, inside = 0, felt = 0, idle = 0;
  double largest_n = 0;
  for (const StackBits& tick : usb.ticks) {
    contact += tick.contact ? 1u : 0u;
    inside += tick.inside ? 1u : 0u;
    felt += tick.force_n > 0.1 ? 1u : 0u;
    idle += tick.ran ? 0u : 1u;
    largest_n = std::max(largest_n, tick.force_n);
  }
  CHECK(contact > 3 * kMinute / 10);
  CHECK(felt > 3 * kMinute / 10);
  CHECK(inside > kMinute / 10);
  CHECK(largest_n > 0.5);
  CHECK(idle == 0u);
  for (const MinuteRun* run : {&direct, &usb}) {
    CHECK(run->faults == 0u);
    CHECK(run->cuts == 0u);
    CHECK(run->armings == 1u);
  }
  CHECK(usb.link.reports == kMinute);
  CHECK(usb.link.states == kMinute);
  CHECK(usb.link.connects == 1u);
  CHECK(usb.link.in_failed + usb.link.send_failed + usb.link.disconnects + usb.link.guard_held ==
        0u);
  MESSAGE(std::string(report_clocked ? "report" : "timer"), "-clocked: ", contact, " of ", kMinute,
          " ticks in contact, ", inside, " in the hole, ", felt,
          " with more than 0.1 N, largest force ", largest_n, " N, ", usb.link.sent,
          " commands sent");
}

}  // namespace

TEST_SUITE("host_sim.device_stack") {
  TEST_CASE("a minute through libusb, timer-clocked: every tick has the bits of the run without") {
    compare_minutes(false);
  }
  TEST_CASE("a minute through libusb, report-clocked: every tick has the bits of the run without") {
    compare_minutes(true);
  }
  TEST_CASE("the comparison sees one bit, and the clockings differ") {
    const MinuteRun timer = run_minute(StackCarrier::kDirect, false, 3000);
    const MinuteRun report = run_minute(StackCarrier::kDirect, true, 3000);
    const std::size_t differ = first_difference(timer.ticks, report.ticks);
    CHECK(differ > 1);  // the same motion until the first force
    CHECK(differ < 3000);
    std::vector<StackBits> changed = timer.ticks;
    changed[2500].tick.state_hash ^= 1;
    CHECK(first_difference(timer.ticks, changed) == 2500);
  }
}
