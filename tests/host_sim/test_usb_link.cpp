// SPDX-License-Identifier: Apache-2.0
// The link through the real libusb to a device in this process: flow, start, close, thread.
#include <doctest/doctest.h>
#include <fcntl.h>

#include <array>
#include <atomic>
#include <thread>

#include "hal/usb/usb_link.hpp"
#include "hal/usb/usb_thread.hpp"
#include "tests/host_sim/usb_link_bench.hpp"
#include "tests/support/own_threads.hpp"
#include "tests/support/rt_guard.hpp"

using namespace haptic;
using namespace haptic::hal;
using namespace haptic::test;

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
      "OUT that the device never takes: said after the silence limit, ramped out, armed again") {
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
      const haptic::DeviceState& state = b.servo.state(&is_new);
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

  TEST_CASE("thread: real-time priority and core only while reports flow, not while it starts") {
    Bench b;
    LinkSettings settings;  // the machine's clock
    settings.address.wrapped_fd = b.carrier->descriptor();
    settings.retry_ns = 1'000'000;
    UsbLink link(b.driver, b.mailbox, settings);
    std::atomic<int> may_start{0}, starting{0};
    b.driver.on_start = [&](UsbPort& port) {
      starting.fetch_add(1);
      while (may_start.load() < starting.load() && !port.cancelled()) std::this_thread::yield();
      return HalStatus::kOk;
    };
    UsbThreadSettings wanted;
    wanted.priority = 7;
    wanted.cpu = 0;
    UsbThread thread(link, wanted);
    const UsbThreadGrant grant = thread.start();
    REQUIRE(grant.create_error == 0);
    if (grant.priority == 0) {
      MESSAGE("skipped: no right to SCHED_FIFO here, so the thread cannot have it");
      return;
    }
    CHECK(grant.priority == 7);
    CHECK(grant.cpu == 0);
    const int all = own_threads().front().cpus;
    for (int round = 1; round <= 2; ++round) {
      CAPTURE(round);
      while (starting.load() < round) std::this_thread::yield();
      CHECK(all_ordinary(own_threads()));
      CHECK(own_thread("haptic-usb").policy == SCHED_OTHER);
      CHECK(own_thread("haptic-usb").cpus == all);
      may_start = round;
      const std::uint64_t states = link.counters().states;
      while (link.counters().states < states + 20) {
        if (link.state() != LinkState::kAbsent) b.report();
        std::this_thread::yield();
      }
      const OwnThread flowing = own_thread("haptic-usb");
      CHECK(flowing.policy == SCHED_FIFO);
      CHECK(flowing.priority == 7);
      CHECK(flowing.cpus == 1);
      CHECK(all_ordinary(own_threads(), "haptic-usb"));
      if (round == 2) break;
      b.carrier->unplug();
      while (link.state() != LinkState::kAbsent) std::this_thread::yield();
      b.plug();
      link.set_wrapped_fd(b.carrier->descriptor());
    }
    thread.stop();
    CHECK(link.state() == LinkState::kAbsent);
  }
}
