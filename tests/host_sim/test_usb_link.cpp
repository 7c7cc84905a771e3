// SPDX-License-Identifier: Apache-2.0
// The link through the real libusb to a device in this process. Time is the test's own.
#include <doctest/doctest.h>
#include <fcntl.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <memory>
#include <thread>

#include "hal/usb/usb_link.hpp"
#include "hal/usb/usb_thread.hpp"
#include "tests/support/rt_guard.hpp"
#include "tests/support/usb_test_device.hpp"

using namespace haptic;
using namespace haptic::hal;
using namespace haptic::test;

namespace {

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr Real kForce_n = 2.0_r;
constexpr double kStep_n = 0.6;  // of the slew limit, in a period
constexpr double kUnit_n = 1.0e-6;

struct Clock {
  std::int64_t now_ns = 1'000'000'000;
  std::function<void()> on_look;
  static std::int64_t read(void* self) {
    auto& clock = *static_cast<Clock*>(self);
    if (clock.on_look) clock.on_look();
    return clock.now_ns;
  }
};

struct LinkLog final : LinkObserver {
  void on_report(std::int64_t, std::span<const std::uint8_t>, ReportVerdict verdict,
                 std::uint64_t) noexcept override {
    ++reports;
    good += verdict == ReportVerdict::kState ? 1 : 0;
  }
  void on_send(std::int64_t, std::span<const std::uint8_t>,
               const GuardedOutput&) noexcept override {
    ++sends;
  }
  void on_link(std::int64_t, LinkState state, HalStatus why) noexcept override {
    if (states < last.size()) last[states++] = {state, why};
  }
  unsigned reports = 0, good = 0, sends = 0;
  std::size_t states = 0;
  std::array<std::pair<LinkState, HalStatus>, 16> last{};
};

// A device on the bus, a link, and a servo thread that is only a command per tick.
struct Bench {
  explicit Bench(LinkSettings settings = {}) {
    plug();
    settings.address.wrapped_fd = carrier->descriptor();
    settings.clock = Clock::read;
    settings.clock_context = &clock;
    link = std::make_unique<UsbLink>(driver, mailbox, settings);
    link->observe(&log);
  }

  // Time passes while the device is closed.
  ~Bench() {
    clock.on_look = [this] { clock.now_ns += 50'000; };
    link->close();
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  void plug() { carrier = std::make_unique<sim::UsbfsCarrier>(device); }
  HalStatus connect() {
    const HalStatus status = link->poll(0);
    return status == HalStatus::kOk ? link->poll(0) : status;
  }
  void report(std::uint32_t damage = 0) {
    ++reported;
    carrier->push(kInEndpoint, packed({reported, 1000 + reported, ready ? 1u : 0u, damage}));
  }
  void command() {
    DeviceCommand c;
    c.tick = ++tick;
    c.stamp_ns = clock.now_ns;
    c.sequence = state().sequence;
    c.wrench_d.force_n[0] = force_n;
    c.arming = arming;
    mailbox.command.publish(c);
  }
  const DeviceState& state() { return mailbox.state.newest(); }
  HalStatus step(bool with_report = true, bool with_command = true) {
    clock.now_ns += kPeriod_ns;
    if (with_command) command();
    if (with_report) report();
    (void)link->poll(0);
    return link->poll(0);
  }
  HalStatus run(int ticks, bool with_report = true, bool with_command = true) {
    HalStatus status = HalStatus::kOk;
    for (int k = 0; k < ticks; ++k) status = step(with_report, with_command);
    return status;
  }
  // Connected, armed, and at full force.
  void work() {
    REQUIRE(connect() == HalStatus::kOk);
    run(5);
    arming += 1;
    run(300);
    REQUIRE(force() == doctest::Approx(static_cast<double>(kForce_n)));
  }
  double force() const { return device.forces_n.empty() ? -1.0 : device.forces_n.back(); }
  double largest_step() const {
    double largest = device.forces_n.empty() ? 0.0 : std::abs(device.forces_n.front());
    for (std::size_t k = 1; k < device.forces_n.size(); ++k)
      largest = std::max(largest, std::abs(device.forces_n[k] - device.forces_n[k - 1]));
    return largest;
  }

  Clock clock;
  LinkLog log;
  UsbTestDevice device;
  UsbTestDriver driver;
  std::unique_ptr<sim::UsbfsCarrier> carrier;
  DeviceMailbox mailbox;
  std::unique_ptr<UsbLink> link;
  std::uint32_t reported = 0, arming = 0;
  std::uint64_t tick = 0;
  Real force_n = kForce_n;
  bool ready = true;
};

}  // namespace

TEST_SUITE("host_sim.usb_link") {
  TEST_CASE("flow: reports become states, the newest command goes out, force only once armed") {
    Bench b;
    REQUIRE(b.connect() == HalStatus::kOk);
    CHECK(b.link->state() == LinkState::kStarting);  // not ready before a report says so
    REQUIRE(b.device.forces_n.size() == 1);          // spoken to unprompted, with nothing
    CHECK(b.run(10) == HalStatus::kOk);
    CHECK(b.link->state() == LinkState::kReady);
    CHECK(b.state().sequence == 10u);
    CHECK(b.state().stamp_ns == b.clock.now_ns);
    CHECK(b.state().pose_dh.p_m[0] == doctest::Approx(1010e-6));
    CHECK(b.state().faults == 0u);
    for (const double f : b.device.forces_n) CHECK(f == 0.0);
    b.arming = 1;
    b.run(300);
    CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
    CHECK(b.device.ticks.back() == b.tick);
    CHECK(b.state().accepted_tick == b.tick - 1);  // the report before it was sent
    CHECK(b.state().accepted_d.force_n[0] == doctest::Approx(kForce_n));
    b.force_n = -kForce_n;
    b.run(20);
    CHECK(b.force() == doctest::Approx(static_cast<double>(-kForce_n)));
    CHECK(b.largest_step() <= kStep_n + 2 * kUnit_n);
    CHECK(b.device.damaged == 0u);
    const LinkCounters n = b.link->counters();
    CHECK(n.reports == 330u);
    CHECK(n.states == 330u);
    CHECK(n.sent == b.device.forces_n.size());
    CHECK(n.sent == 331u);  // one for each report, and the first
    CHECK(n.connects == 1u);
    CHECK(n.send_busy + n.send_failed + n.in_failed + n.disconnects == 0u);
    CHECK(b.log.good == 330u);
    CHECK(b.log.sends == 331u);
    CHECK(b.carrier->waiting(kInEndpoint) == 3u);
  }

  TEST_CASE("busy: one OUT in flight, what waited is not sent, the newest is") {
    Bench b;
    b.work();
    b.carrier->hold_out(true);
    b.force_n = 1.0_r;
    b.run(5);
    CHECK(b.carrier->waiting(kOutEndpoint) == 1u);
    CHECK(b.link->counters().send_busy >= 4u);
    const std::size_t before = b.device.forces_n.size();
    b.carrier->hold_out(false);
    b.link->poll(0);
    REQUIRE(b.device.forces_n.size() == before + 2);  // the one that was held, and the newest
    CHECK(b.device.ticks.back() == b.tick);
    CHECK(b.run(10) == HalStatus::kOk);
    CHECK(b.force() == doctest::Approx(1.0));
    CHECK(b.state().faults == 0u);
  }

  TEST_CASE(
      "OUT that the device never takes: said after the silence limit, ramped out, armed anew") {
    Bench b;
    b.work();
    b.carrier->hold_out(true);
    b.run(25);
    CHECK((b.state().faults & kLinkSendFailed) != 0u);
    CHECK(b.link->counters().send_failed == 1u);  // taken back; the next one is held by now
    CHECK(b.carrier->waiting(kOutEndpoint) == 1u);
    b.carrier->hold_out(false);
    b.run(30);
    CHECK(b.force() == 0.0);
    CHECK(b.state().faults == 0u);
    b.arming += 1;
    b.run(300);
    CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
  }

  TEST_CASE("IN errors: a stall is cleared, others are tried again, and force goes on") {
    for (const int error : {-EPIPE, -EOVERFLOW, -EPROTO, -EILSEQ, -ETIME}) {
      INFO("errno ", -error);
      Bench b;
      b.work();
      b.carrier->fail_next(kInEndpoint, error, 2);
      CHECK(b.run(10) == HalStatus::kOk);
      CHECK(b.link->counters().in_failed == 2u);
      CHECK(b.device.halts_cleared == (error == -EPIPE ? 2u : 0u));
      CHECK(b.carrier->waiting(kInEndpoint) == 3u);
      CHECK(b.state().stamp_ns == b.clock.now_ns);
      CHECK(b.state().faults == 0u);
      CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
    }
  }

  TEST_CASE("IN errors without end: the link is given up, said so, and opened again") {
    Bench b;
    b.work();
    b.carrier->fail_next(kInEndpoint, -EPROTO, 11);
    CHECK(b.run(12) == HalStatus::kTransferFailed);
    CHECK(b.state().link == LinkState::kAbsent);
    CHECK((b.state().faults & kLinkLost) != 0u);
    CHECK(b.link->trouble().find("test device (1209:000f)") != std::string::npos);
    CHECK(b.carrier->waiting(kInEndpoint) == 0u);
    b.clock.now_ns += 200'000'000;
    CHECK(b.connect() == HalStatus::kOk);
    CHECK(b.link->trouble().empty());
    b.run(10);
    CHECK(b.state().link == LinkState::kReady);
    CHECK(b.state().faults == 0u);
    CHECK(b.force() == 0.0);
    CHECK(b.link->counters().connects == 2u);
  }

  TEST_CASE("OUT errors: the next output starts from what the device has") {
    for (const int error : {-EPIPE, -EPROTO}) {
      INFO("errno ", -error);
      Bench b;
      b.work();
      b.carrier->fail_next(kOutEndpoint, error, 2);
      b.force_n = 0.0_r;
      const std::size_t before = b.device.forces_n.size();
      CHECK(b.run(10) == HalStatus::kOk);
      CHECK(b.link->counters().send_failed == 2u);
      CHECK(b.device.halts_cleared == (error == -EPIPE ? 2u : 0u));
      // Whatever happened to the transfers, the first that arrives is one allowed step away, by the
      // time since the last that did.
      REQUIRE(b.device.forces_n.size() > before);
      CHECK(b.device.forces_n[before - 1] - b.device.forces_n[before] <= 3 * kStep_n + kUnit_n);
      CHECK(b.force() == 0.0);
      CHECK(b.state().faults == 0u);
    }
  }

  TEST_CASE("OUT errors for long: what the device gets next is one bounded step from what it has") {
    LinkSettings settings;
    settings.limits.slew_n_per_s = 100.0_r;
    Bench b(settings);
    b.work();
    b.carrier->fail_next(kOutEndpoint, -EPROTO, 9);
    b.force_n = 0.0_r;
    const std::size_t before = b.device.forces_n.size();
    b.run(9);
    CHECK((b.state().faults & kLinkSendFailed) != 0u);
    REQUIRE(b.device.forces_n.size() == before);
    b.run(1);
    REQUIRE(b.device.forces_n.size() > before);
    // Ten periods have passed; no more than kLongestRampTick_s of them counts.
    CHECK(b.device.forces_n[before - 1] - b.device.forces_n[before] <= 0.5 + kUnit_n);
    b.run(30);
    CHECK(b.force() == 0.0);
    CHECK(b.state().faults == 0u);
  }

  TEST_CASE("submit refused for want of memory: counted, tried again, one send more or less") {
    Bench b;
    b.work();
    b.carrier->refuse_submit(kInEndpoint, -ENOMEM, 4);
    b.carrier->refuse_submit(kOutEndpoint, -ENOMEM, 2);
    CHECK(b.run(10) == HalStatus::kOk);
    CHECK(b.link->counters().in_failed == 4u);
    CHECK(b.link->counters().send_failed == 2u);
    CHECK(b.carrier->waiting(kInEndpoint) == 3u);
    CHECK(b.state().faults == 0u);
    CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
    b.carrier->refuse_submit(kOutEndpoint, -ENOMEM, 5);
    b.run(5);
    CHECK((b.state().faults & kLinkSendFailed) != 0u);
    b.run(20);
    CHECK(b.force() == 0.0);  // until armed anew
    CHECK(b.largest_step() <= 5 * kStep_n);
  }

  TEST_CASE("unplug in flight, and re-plug: zero until armed anew") {
    LinkSettings settings;
    settings.limits.slew_n_per_s = 100.0_r;  // a ramp from where it was would show
    Bench b(settings);
    b.work();
    b.carrier->unplug();
    CHECK(b.link->poll(0) == HalStatus::kDeviceGone);
    CHECK(b.state().link == LinkState::kAbsent);
    CHECK(b.state().faults == kLinkLost);
    CHECK(b.state().pose_dh.p_m[0] > 0.0_r);  // the last one
    CHECK(b.link->trouble().find("LIBUSB_ERROR_NO_DEVICE") != std::string::npos);
    const int starts = b.driver.starts;
    b.clock.now_ns += 1'000'000'000;
    for (int k = 0; k < 3; ++k) CHECK(b.link->poll(0) == HalStatus::kDeviceGone);
    CHECK(b.driver.starts == starts);  // that descriptor is used up

    const std::uint64_t sequence = b.state().sequence;
    const std::size_t before = b.device.forces_n.size();
    b.plug();
    b.reported = 0;
    b.link->set_wrapped_fd(b.carrier->descriptor());
    b.clock.now_ns += kPeriod_ns;  // a new descriptor is not kept waiting
    CHECK(b.connect() == HalStatus::kOk);
    b.run(50);
    CHECK(b.state().link == LinkState::kReady);
    CHECK(b.state().faults == 0u);  // the servo has answered a state that carried it
    CHECK(b.state().sequence == sequence + 50);
    for (std::size_t k = before; k < b.device.forces_n.size(); ++k)
      CHECK(b.device.forces_n[k] == 0);
    b.arming += 1;
    b.run(300);
    CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
    CHECK(b.link->counters().connects == 2u);
    CHECK(b.link->counters().disconnects == 1u);
    REQUIRE(b.log.states == 5);
    CHECK(b.log.last[2] == std::pair(LinkState::kAbsent, HalStatus::kDeviceGone));
  }

  TEST_CASE("unplug between a completion and its resubmit: only the submit's code says so") {
    LinkSettings settings;
    settings.in_transfers = 2;
    Bench b(settings);
    b.work();
    b.report();  // with the one of the step: both transfers have ended, none is left to fail
    b.carrier->unplug_at_next_resubmit();
    CHECK(b.step() == HalStatus::kDeviceGone);
    CHECK(b.link->counters().in_failed == 1u);
    CHECK(b.state().link == LinkState::kAbsent);
    CHECK(b.state().faults == kLinkLost);
  }

  TEST_CASE("unplug while sending") {
    Bench b;
    b.work();
    b.device.on_command = [&] { b.carrier->unplug(); };
    CHECK(b.step() == HalStatus::kDeviceGone);
    CHECK(b.state().link == LinkState::kAbsent);
  }

  TEST_CASE("reports stop: commands still go out each period, and silence is said") {
    Bench b;
    b.work();
    const std::size_t before = b.device.forces_n.size();
    b.run(15, false);
    CHECK(b.device.forces_n.size() >= before + 14);
    CHECK(b.state().faults == 0u);
    b.run(15, false);
    CHECK(b.state().faults == kLinkSilent);
    CHECK(b.force() == 0.0);
    CHECK(b.largest_step() <= kStep_n + 2 * kUnit_n);
    b.run(5);
    CHECK(b.state().faults == 0u);
    CHECK(b.force() == 0.0);
  }

  TEST_CASE("commands stop: hold, decay, zero, latched, whether reports come or not") {
    for (const bool reports : {true, false}) {
      INFO("reports come: ", reports);
      Bench b;
      b.work();
      b.run(15, reports, false);
      CHECK(b.force() == 0.0);
      // Without reports the first output comes by time, two of this test's periods after the last.
      CHECK(b.largest_step() <= (reports ? 1 : 2) * kStep_n + 2 * kUnit_n);
      CHECK((b.state().faults & kLinkStaleCommand) != 0u);
      CHECK(b.link->counters().guard_held >= 3u);
      b.run(10);
      CHECK(b.state().faults == 0u);
      CHECK(b.force() == 0.0);
      b.arming += 1;
      b.run(300);
      CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
    }
  }

  TEST_CASE("servo process ended: ramped out and said, until another answers") {
    Bench b;
    b.work();
    b.link->servo_lost();
    b.run(2, true, false);
    CHECK((b.state().faults & kLinkServoLost) != 0u);
    b.run(10, true, false);
    CHECK(b.force() == 0.0);
    b.tick = 0;  // the new one counts anew
    b.arming = 0;
    b.run(10);
    CHECK(b.force() == 0.0);
    CHECK(b.state().faults == 0u);
    b.arming = 1;
    b.run(300);
    CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
  }

  TEST_CASE("reports that are damaged or do not advance: said after so many in a row") {
    Bench b;
    b.work();
    const auto bad = [&](int times, std::uint32_t damage) {
      for (int k = 0; k < times; ++k) {
        b.clock.now_ns += kPeriod_ns;
        b.command();
        b.reported -= damage == 0 ? 1 : 0;
        b.report(damage);
        b.link->poll(0);
      }
    };
    const std::uint64_t sequence = b.state().sequence;
    bad(4, 0x100);
    CHECK(b.state().faults == 0u);
    bad(1, 0x100);
    CHECK(b.state().faults == kLinkCorrupt);
    CHECK(b.state().sequence == sequence);
    CHECK(b.link->counters().bad_check == 5u);
    b.run(5);
    CHECK(b.state().faults == 0u);
    bad(9, 0);
    CHECK(b.state().faults == 0u);
    bad(1, 0);
    CHECK(b.state().faults == kLinkFrozen);
    CHECK(b.link->counters().not_advancing == 10u);
    b.carrier->push(kInEndpoint, std::array<std::uint8_t, 7>{});
    b.link->poll(0);
    CHECK(b.link->counters().bad_length == 1u);
    b.run(10);
    CHECK(b.force() == 0.0);  // until armed anew
  }

  TEST_CASE("not calibrated any more: no force until it is, and armed anew") {
    Bench b;
    b.work();
    b.ready = false;
    b.run(20);
    CHECK(b.link->state() == LinkState::kStarting);
    CHECK(b.force() == 0.0);
    CHECK(b.largest_step() <= kStep_n + 2 * kUnit_n);
    b.ready = true;
    b.arming += 1;
    b.run(1);
    b.run(50);
    CHECK(b.force() > 0.0);
  }

  TEST_CASE("lock-step: a device that answers only what it is sent is kept going") {
    Bench b;
    b.device.on_command = [&] { b.report(); };
    REQUIRE(b.connect() == HalStatus::kOk);
    for (int k = 0; k < 20; ++k) {
      b.clock.now_ns += kPeriod_ns;
      b.command();
      b.link->poll(0);
    }
    CHECK(b.link->counters().states >= 20u);
    CHECK(b.device.forces_n.size() >= 20u);
  }

  TEST_CASE("report-clocked: what goes out answers the report that has just come") {
    LinkSettings settings;
    settings.answer_wait_ns = 500'000;
    Bench b(settings);
    REQUIRE(b.connect() == HalStatus::kOk);
    std::uint64_t answered = 0;
    b.clock.on_look = [&] {  // the servo thread, as fast as can be
      bool is_new = false;
      const DeviceState& state = b.mailbox.state.newest(&is_new);
      if (!is_new || state.sequence == answered) return;
      answered = state.sequence;
      b.command();
    };
    for (int k = 0; k < 20; ++k) {
      b.step(true, false);
      CHECK(b.device.ticks.back() == b.tick);
      CHECK(b.tick == answered);
    }
    CHECK(b.link->counters().answers_late == 0u);
    b.clock.on_look = [&] { b.clock.now_ns += 10'000; };  // no answer, but time passes
    b.step(true, false);
    CHECK(b.link->counters().answers_late == 1u);
  }

  TEST_CASE("heap: a tick makes two submits of libusb, and nothing of ours") {
    Bench b;
    b.work();
    std::uint64_t calls = 0;
    constexpr int kTicks = 200;
    for (int k = 0; k < kTicks; ++k) {
      b.clock.now_ns += kPeriod_ns;
      b.command();
      b.report();
      const RtGuard guard;
      (void)b.link->poll(0);
      calls += guard.heap_calls();
    }
    // One calloc and one free each; none where a sanitizer has the heap.
    MESSAGE("heap calls per tick: ", static_cast<double>(calls) / kTicks);
    CHECK(calls <= 4u * kTicks);
    CHECK(calls % kTicks == 0u);
  }

  TEST_CASE("close: ramps to zero, lets the last one arrive, cancels, and leaves the descriptor") {
    Bench b;
    b.work();
    const int descriptor = b.carrier->descriptor();
    b.clock.on_look = [&] { b.clock.now_ns += 50'000; };
    b.link->close();
    CHECK(b.force() == 0.0);
    CHECK(b.largest_step() <= 5 * kStep_n);
    CHECK(b.carrier->waiting(kInEndpoint) == 0u);
    CHECK(b.carrier->waiting(kOutEndpoint) == 0u);
    CHECK(b.state().link == LinkState::kAbsent);
    CHECK((b.state().faults & kLinkLost) == 0u);
    CHECK(::fcntl(descriptor, F_GETFD) >= 0);
    b.clock.on_look = nullptr;
    CHECK(b.connect() == HalStatus::kOk);  // and can be opened again
  }

  TEST_CASE("close: bounded where the device takes nothing") {
    Bench b;
    b.work();
    b.carrier->hold_out(true);
    b.run(3);
    b.link->close();
    CHECK(b.carrier->waiting(kInEndpoint) == 0u);
    CHECK(b.carrier->waiting(kOutEndpoint) == 0u);
  }

  TEST_CASE("start: the driver talks to the device before reports flow") {
    Bench b;
    b.driver.on_start = [&](UsbPort& port) {
      CHECK(b.link->state() == LinkState::kStarting);
      std::array<std::uint8_t, 4> bytes{};
      std::size_t moved = 0;
      CHECK(port.control({0xc0, 7, 0x2a, 0}, bytes, moved, 1000) == HalStatus::kOk);
      CHECK(moved == 4u);
      CHECK(bytes[3] == 0x2a);
      CHECK(port.control({0xc0, 9, 0, 0}, bytes, moved, 1000) == HalStatus::kTransferFailed);
      CHECK(port.write(packed({1, 2}), 1000) == HalStatus::kOk);
      b.report();
      std::array<std::uint8_t, 16> packet{};
      CHECK(port.read(packet, moved, 1000) == HalStatus::kOk);
      CHECK(moved == 16u);
      b.carrier->push(kInEndpoint, std::array<std::uint8_t, 3>{7, 8, 9});
      CHECK(port.read(bytes, moved, 1000) == HalStatus::kOk);  // shorter than a packet may be
      CHECK(moved == 3u);
      CHECK(bytes[2] == 9);
      CHECK(port.read(packet, moved, 5) == HalStatus::kTimeout);
      return HalStatus::kOk;
    };
    CHECK(b.connect() == HalStatus::kOk);
    CHECK(b.device.ticks.front() == 2u);
    CHECK(b.run(3) == HalStatus::kOk);
  }

  TEST_CASE("start fails: said, closed, and tried again after its time") {
    Bench b;
    b.driver.on_start = [](UsbPort&) { return HalStatus::kStartFailed; };
    CHECK(b.link->poll(0) == HalStatus::kStartFailed);
    CHECK(b.link->state() == LinkState::kAbsent);
    CHECK(b.link->trouble().find("start the device") != std::string::npos);
    CHECK(b.link->poll(0) == HalStatus::kStartFailed);
    CHECK(b.driver.starts == 1);
    b.driver.on_start = nullptr;
    b.clock.now_ns += 200'000'000;
    CHECK(b.connect() == HalStatus::kOk);
    CHECK(b.driver.starts == 2);
  }

  TEST_CASE("a device without the driver's endpoints is unfit") {
    Bench b;
    b.device.interrupt_out = false;
    b.plug();
    b.link->set_wrapped_fd(b.carrier->descriptor());
    CHECK(b.link->poll(0) == HalStatus::kDeviceUnfit);
    CHECK(b.driver.starts == 0);
  }

  TEST_CASE("thread: flows, gives up a start that waits, and leaves the device at zero") {
    Bench b;
    LinkSettings settings;  // the machine's clock
    settings.address.wrapped_fd = b.carrier->descriptor();
    UsbLink link(b.driver, b.mailbox, settings);
    std::atomic<bool> waiting{false};
    b.driver.on_start = [&](UsbPort& port) {
      std::array<std::uint8_t, 16> packet{};
      std::size_t moved = 0;
      waiting.store(true);
      waiting.notify_all();
      while (!port.cancelled()) (void)port.read(packet, moved, 60'000);
      return HalStatus::kTimeout;
    };
    UsbThread thread(link, {});
    REQUIRE(thread.start().create_error == 0);
    waiting.wait(false);
    thread.stop();  // would take a minute, were the read not given up
    CHECK(link.state() == LinkState::kAbsent);

    b.driver.on_start = nullptr;
    REQUIRE(thread.start().create_error == 0);
    while (link.state() == LinkState::kAbsent) std::this_thread::yield();
    while (link.counters().states < 50) {
      b.report();
      std::this_thread::yield();
    }
    CHECK(thread.status() == HalStatus::kOk);
    thread.stop();
    CHECK(b.force() == 0.0);
    CHECK(link.state() == LinkState::kAbsent);
    CHECK(b.carrier->waiting(kInEndpoint) == 0u);
    CHECK(b.carrier->waiting(kOutEndpoint) == 0u);
  }
}
