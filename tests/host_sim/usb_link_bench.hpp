// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A device on the bus in this process, a link to it through the real libusb, and a servo thread
/// that is only a command per tick. Time is the test's own.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>

#include "hal/usb/usb_link.hpp"
#include "tests/support/usb_test_device.hpp"

namespace haptic::test {

inline constexpr std::int64_t kPeriod_ns = 1'000'000;
inline constexpr Real kForce_n = 2.0_r;
inline constexpr double kStep_n = 0.6;  // of the slew limit, in a period
inline constexpr double kUnit_n = 1.0e-6;

struct Clock {
  std::int64_t now_ns = 1'000'000'000;
  std::int64_t slept_ns = 0;
  std::function<void()> on_look;
  static std::int64_t read(void* self) {
    auto& clock = *static_cast<Clock*>(self);
    if (clock.on_look) clock.on_look();
    return clock.now_ns;
  }
};

struct LinkLog final : hal::LinkObserver {
  void on_report(std::int64_t, std::span<const std::uint8_t>, hal::ReportVerdict verdict,
                 std::uint64_t) noexcept override {
    ++reports;
    good += verdict == hal::ReportVerdict::kState ? 1 : 0;
  }
  void on_send(std::int64_t, std::span<const std::uint8_t>,
               const hal::GuardedOutput&) noexcept override {
    ++sends;
  }
  void on_link(std::int64_t, LinkState state, hal::HalStatus why) noexcept override {
    if (states < last.size()) last[states++] = {state, why};
  }
  unsigned reports = 0, good = 0, sends = 0;
  std::size_t states = 0;
  std::array<std::pair<LinkState, hal::HalStatus>, 16> last{};
};

// A device on the bus, a link, and a servo thread that is only a command per tick.
struct Bench {
  explicit Bench(hal::LinkSettings settings = {}) {
    plug();
    settings.address.wrapped_fd = carrier->descriptor();
    settings.clock = Clock::read;
    settings.clock_context = &clock;
    link = std::make_unique<hal::UsbLink>(driver, mailbox, settings);
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
  hal::HalStatus connect() {
    const hal::HalStatus status = link->poll(0);
    return status == hal::HalStatus::kOk ? link->poll(0) : status;
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
    servo.publish(c);
  }
  const DeviceState& state() { return servo.state(); }
  hal::HalStatus step(bool with_report = true, bool with_command = true) {
    clock.now_ns += kPeriod_ns;
    if (with_command) command();
    if (with_report) report();
    (void)link->poll(0);
    return link->poll(0);
  }
  hal::HalStatus run(int ticks, bool with_report = true, bool with_command = true) {
    hal::HalStatus status = hal::HalStatus::kOk;
    for (int k = 0; k < ticks; ++k) status = step(with_report, with_command);
    return status;
  }
  // Connected, armed, and at full force.
  void work() {
    REQUIRE(connect() == hal::HalStatus::kOk);
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
  hal::MailboxMemory mailbox;
  hal::ServoSide servo{mailbox};
  std::unique_ptr<hal::UsbLink> link;
  std::uint32_t reported = 0, arming = 0;
  std::uint64_t tick = 0;
  Real force_n = kForce_n;
  bool ready = true;
};

}  // namespace haptic::test
