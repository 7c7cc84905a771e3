// SPDX-License-Identifier: Apache-2.0
// The link through the real libusb to a device in this process: what comes from elsewhere than the
// device, what a device that never answers control requests costs, and how a session ends.
#include <doctest/doctest.h>

#include <cerrno>
#include <chrono>
#include <thread>

#include "hal/clock/servo_clock.hpp"
#include "tests/host_sim/usb_link_bench.hpp"

using namespace haptic;
using namespace haptic::hal;
using namespace haptic::test;

namespace {

/// Longest end that UsbLink states: the ramp and its delivery, and the callbacks of what is
/// cancelled; a noisy machine adds to it.
constexpr double kLongestEnd_s = 0.3 + 0.5 + 0.3;
/// A turn that waits for nothing, on a noisy machine; the kernel's call waits for 5 s.
constexpr double kLongestTurn_s = 1.0;

double seconds_since(std::int64_t begin_ns) {
  return 1e-9 * static_cast<double>(monotonic_ns() - begin_ns);
}

struct Pedal final : SwitchSource {
  std::uint32_t pressed() noexcept override { return down ? kInputSwitch : 0u; }
  bool down = false;
};

/// Of all forces from `begin` on, none is larger than the one before it.
bool falls(const std::vector<double>& forces_n, std::size_t begin) {
  for (std::size_t k = begin + 1; k < forces_n.size(); ++k) {
    if (std::abs(forces_n[k]) > std::abs(forces_n[k - 1])) return false;
  }
  return true;
}

}  // namespace

TEST_SUITE("host_sim.link_calls") {
  TEST_CASE(
      "emergency_stop: from any thread; ramps to zero, latched until let go and armed again") {
    Bench b;
    b.work();
    const std::size_t begin = b.device.forces_n.size() - 1;
    std::thread([&b] { b.link->emergency_stop(); }).join();
    b.force_n = 3 * kForce_n;  // no matter what is asked
    b.run(1);
    CHECK((b.state().faults & kLinkStopCalled) != 0u);
    b.run(20);
    CHECK(b.force() == 0.0);
    CHECK(falls(b.device.forces_n, begin));
    CHECK(b.largest_step() <= kStep_n + kUnit_n);
    CHECK(b.state().faults == 0u);  // a command has answered it
    b.force_n = kForce_n;
    b.run(50);
    CHECK(b.force() == 0.0);
    b.arming += 1;
    b.run(300);
    CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
  }

  TEST_CASE("emergency_stop without a device: kept until there is one") {
    Bench b;
    b.link->emergency_stop();
    REQUIRE(b.connect() == HalStatus::kOk);
    CHECK((b.state().faults & kLinkStopCalled) != 0u);
  }

  TEST_CASE(
      "emergency_stop as the operator arms: what was armed before it was seen does not count") {
    Bench b;
    REQUIRE(b.connect() == HalStatus::kOk);
    b.run(5);
    b.arming += 1;
    b.link->emergency_stop();
    b.run(1);
    CHECK((b.state().faults & kLinkStopCalled) != 0u);
    b.run(50);
    CHECK(b.force() == 0.0);
  }

  TEST_CASE("sleep of the machine: its clock shows nothing, the force ramps out and is said why") {
    LinkSettings settings;
    settings.slept = [](void* clock) { return static_cast<Clock*>(clock)->slept_ns; };
    Bench b(settings);
    b.clock.slept_ns = 3'600'000'000'000;  // before all this
    b.work();
    const std::size_t begin = b.device.forces_n.size() - 1;
    b.clock.slept_ns += 19'000'000;  // two clocks are not read at one instant
    b.run(5);
    CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
    b.clock.slept_ns += 60'000'000'000;
    b.run(1);
    CHECK((b.state().faults & kLinkSuspended) != 0u);
    b.run(20);
    CHECK(b.force() == 0.0);
    CHECK(falls(b.device.forces_n, begin));
    CHECK(b.state().faults == 0u);
    b.arming += 1;
    b.run(300);
    CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
  }

  TEST_CASE("machine_slept_ns: does not grow while nobody sleeps") {
    const std::int64_t before = machine_slept_ns();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    CHECK(before >= 0);
    CHECK(std::abs(machine_slept_ns() - before) < 10'000'000);
  }

  TEST_CASE("a switch beside the device: in its states, and what the guard goes by") {
    Pedal pedal;
    LinkSettings settings;
    settings.switches = &pedal;
    settings.deadman = kInputSwitch;
    Bench b(settings);
    REQUIRE(b.connect() == HalStatus::kOk);
    b.run(5);
    CHECK((b.state().switches & kInputSwitch) == 0u);
    b.arming += 1;
    b.run(100);
    CHECK(b.force() == 0.0);  // the servo thread says it is armed, the pedal says otherwise
    pedal.down = true;
    b.run(5);
    CHECK((b.state().switches & kInputSwitch) != 0u);
    CHECK(b.force() == 0.0);
    b.arming += 1;
    b.run(300);
    REQUIRE(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
    const std::size_t begin = b.device.forces_n.size() - 1;
    pedal.down = false;
    b.run(20);
    CHECK(b.force() == 0.0);
    CHECK(falls(b.device.forces_n, begin));
    CHECK((b.state().switches & kInputSwitch) == 0u);
  }

  TEST_CASE("close: after the zero that was delivered, what takes the drives off, once") {
    Bench b;
    b.driver.releases = true;
    b.work();
    b.clock.on_look = [&b] { b.clock.now_ns += 50'000; };
    b.link->close();
    CHECK(b.device.released == 1u);
    REQUIRE(b.device.forces_n.size() > 2);
    CHECK(b.force() == 0.0);
    CHECK(b.device.force_before_release_n == 0.0);
    CHECK(b.device.forces_after_release == 0u);
    CHECK(b.largest_step() <= 2 * kStep_n + kUnit_n);
  }

  TEST_CASE("unplugged: no release is made up") {
    Bench b;
    b.driver.releases = true;
    b.work();
    b.carrier->unplug();
    b.run(5);
    b.link->close();
    CHECK(b.device.released == 0u);
  }

  TEST_CASE("a device that never answers control requests: no turn waits, the link is given up") {
    for (const std::uint8_t endpoint : {kInEndpoint, kOutEndpoint}) {
      CAPTURE(int{endpoint});
      Bench b;
      b.work();
      b.carrier->hold_control(true);
      b.carrier->fail_next(endpoint, -EPIPE, 1);
      const std::size_t begin = b.device.forces_n.size() - 1;
      int periods = 0;
      for (; periods < 200 && b.link->state() != LinkState::kAbsent; ++periods) {
        const std::int64_t turn_ns = monotonic_ns();
        b.step();
        CHECK(seconds_since(turn_ns) < kLongestTurn_s);
      }
      // Silence alone would not give the link up.
      CHECK(periods >= 50);
      CHECK(periods <= 55);
      CHECK((b.state().faults & kLinkLost) != 0u);
      CHECK(falls(b.device.forces_n, begin));
      if (endpoint == kInEndpoint) CHECK(b.force() == 0.0);  // there was a way to say so
    }
  }

  TEST_CASE("a device that never answers control requests: every end is bounded") {
    for (const std::uint8_t endpoint : {kInEndpoint, kOutEndpoint}) {
      CAPTURE(int{endpoint});
      Bench b;
      b.work();
      b.carrier->hold_control(true);
      b.carrier->fail_next(endpoint, -EPIPE, 1);
      b.run(3);
      b.clock.on_look = [&b] { b.clock.now_ns += 50'000; };
      const std::int64_t begin_ns = monotonic_ns();
      b.link->close();
      CHECK(seconds_since(begin_ns) < kLongestEnd_s);
      CHECK(b.link->state() == LinkState::kAbsent);
    }
  }

  TEST_CASE("a start that waits for an answer gives up when it is cancelled") {
    Bench b;
    HalStatus answered = HalStatus::kOk;
    b.driver.on_start = [&](UsbPort& port) {
      b.carrier->hold_control(true);
      std::array<std::uint8_t, 4> bytes{};
      std::size_t moved = 0;
      answered = port.control({0xc0, 7, 42, 0}, bytes, moved, 60'000);
      CHECK(moved == 0u);
      return answered;
    };
    std::thread end([&b] {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      b.link->cancel();
    });
    const std::int64_t begin_ns = monotonic_ns();
    CHECK(b.link->poll(0) != HalStatus::kOk);
    CHECK(seconds_since(begin_ns) < kLongestTurn_s);
    CHECK(answered == HalStatus::kTimeout);
    end.join();
    // Not cancelled: the time that it was given, and no more.
    b.link->close();
    b.driver.on_start = [&](UsbPort& port) {
      std::array<std::uint8_t, 4> bytes{};
      std::size_t moved = 0;
      return answered = port.control({0xc0, 7, 42, 0}, bytes, moved, 120);
    };
    const std::int64_t again_ns = monotonic_ns();
    CHECK(b.link->poll(0) == HalStatus::kTimeout);
    CHECK(seconds_since(again_ns) >= 0.1);
    CHECK(seconds_since(again_ns) < kLongestTurn_s);
    b.driver.on_start = nullptr;
    b.carrier->hold_control(false);
  }
}
