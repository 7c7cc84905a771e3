// SPDX-License-Identifier: Apache-2.0
// A board of full speed, the firmware in C behind the descriptors of PROTOCOL.md, through the real
// libusb: short reports in, force out, watchdog, and a bus event at the plug.
#include <doctest/doctest.h>

#include <array>
#include <cerrno>
#include <memory>
#include <vector>

#include "hal/drivers/reference_driver.hpp"
#include "hal/firmware/reference_device.h"
#include "hal/usb/usb_link.hpp"
#include "host_sim/device/usbfs_carrier.hpp"
#include "tests/hal/protocol_text.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

constexpr std::int64_t kBoardPeriod_ns = 1'000'000;

class FullSpeedBoard final : public sim::UsbFunction {
 public:
  FullSpeedBoard() {
    haptic_facts facts{};
    facts.sensed_dof = facts.driven_dof = 0x3f;
    facts.is_short = 1;
    facts.report_period_us = 1000;
    facts.watchdog_ms = 20;
    facts.max_force = 1'200'000;
    facts.max_torque = 3'000'000;
    facts.max_force_rate_mn_per_s = 2'000'000;
    facts.max_torque_rate_mnm_per_s = 40'000;
    facts.mass_mg = 100'000;
    haptic_device_begin(&firmware, &facts);
    sample.orientation[3] = 1 << 30;
    sample.is_calibrated = 1;
  }

  std::vector<std::uint8_t> descriptors() const override {
    std::vector<std::uint8_t> all = haptic::hal::test::bytes_in("hex device-descriptor");
    for (const std::uint8_t byte :
         haptic::hal::test::bytes_in("hex full-speed-configuration-descriptor"))
      all.push_back(byte);
    return all;
  }
  int speed() const override { return 2; }
  int control(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t,
              std::span<std::uint8_t> bytes) override {
    if ((type & 0x60u) == 0) {
      haptic_device_bus_event(&firmware);
      return 0;
    }
    const std::int32_t length =
        haptic_device_answer(&firmware, type, request, value, bytes.data(), bytes.size());
    return length < 0 ? -EPIPE : length;
  }
  int out(std::uint8_t, std::span<const std::uint8_t> bytes) override {
    accepted += haptic_device_command(&firmware, bytes.data(), bytes.size(), sample.time_us) != 0;
    return static_cast<int>(bytes.size());
  }
  /// The next report.
  std::vector<std::uint8_t> period() {
    sample.time_us += 1000;
    std::vector<std::uint8_t> packet(64);
    packet.resize(haptic_device_period(&firmware, &sample, packet.data(), packet.size()));
    return packet;
  }
  [[nodiscard]] double force_n() const { return haptic_device_drive(&firmware)->force[0] * 1e-5; }

  haptic_device firmware{};
  haptic_sample sample{};
  int accepted = 0;
};

/// Board, bus, link, and a servo thread that is only a command per tick.
struct BoardBench {
  BoardBench() : carrier(board) {
    LinkSettings settings;
    settings.address.wrapped_fd = carrier.descriptor();
    settings.clock = [](void* self) { return *static_cast<std::int64_t*>(self); };
    settings.clock_context = &now_ns;
    link = std::make_unique<UsbLink>(driver, mailbox, settings);
  }
  void run(int ticks) {
    for (int k = 0; k < ticks; ++k) {
      now_ns += kBoardPeriod_ns;
      DeviceCommand c;
      c.tick = ++tick;
      c.stamp_ns = now_ns;
      c.sequence = servo.state().sequence;
      c.wrench_d.force_n[0] = 2;
      c.arming = arming;
      servo.publish(c);
      const std::vector<std::uint8_t> packet = board.period();
      REQUIRE(packet.size() == 60);
      carrier.push(0x81, packet);
      for (int turn = 0; turn < 2; ++turn) (void)link->poll(0);
    }
  }
  FullSpeedBoard board;
  sim::UsbfsCarrier carrier;
  std::int64_t now_ns = 1'000'000'000;
  ReferenceDriver driver;
  MailboxMemory mailbox;
  ServoSide servo{mailbox};
  std::unique_ptr<UsbLink> link;
  std::uint32_t arming = 0;
  std::uint64_t tick = 0;
};

}  // namespace

TEST_SUITE("host_sim.full_speed_board") {
  TEST_CASE("full speed: short reports become states, and a force passes") {
    BoardBench b;
    REQUIRE(b.link->poll(0) == HalStatus::kOk);
    b.board.sample.position_nm[2] = -7'000'000;
    b.run(20);
    CHECK(b.link->state() == LinkState::kReady);
    CHECK(b.servo.state().faults == 0);
    CHECK(static_cast<double>(b.servo.state().pose_dh.p_m[2]) == doctest::Approx(-0.007));
    CHECK(b.board.force_n() == 0);
    b.arming = 1;
    b.run(300);
    CHECK(b.board.force_n() == doctest::Approx(2.0));
    CHECK(b.link->counters().states == 320);
    CHECK(b.board.firmware.rejected == 0);
    for (int k = 0; k < 20; ++k) b.board.period();  // the host says nothing
    CHECK(b.board.force_n() == 0);
    b.run(2);
    CHECK((b.servo.state().faults & kDeviceWatchdogCut) != 0);
    b.link->cancel();
    b.link->close();
    CHECK(b.board.force_n() == 0);
  }
}
