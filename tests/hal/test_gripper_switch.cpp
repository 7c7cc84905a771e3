// SPDX-License-Identifier: Apache-2.0
// A gripper as a switch: its play, and what a link makes of gaps that come, go and are none.
#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "hal/clock/servo_clock.hpp"
#include "hal/device_limits.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/input/gripper_switch.hpp"
#include "hal/local/local_link.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

constexpr std::int64_t kGripPeriod_ns = 1'000'000;
constexpr int kMostGripTurns = 5000;
constexpr GripperSettings kGrip{0.005_r, 0.008_r};

/// A device of 1.1 with a gripper of 70 mm; its drives follow what is asked.
class GripperPeer final : public LocalPeer {
 public:
  HalStatus plug(std::int64_t now_ns) noexcept override {
    due_ns_ = now_ns;
    return HalStatus::kOk;
  }
  HalStatus control(const ControlRequest&, std::span<std::uint8_t> bytes,
                    std::size_t& moved) noexcept override {
    ReferenceLongBlock block;
    block.largest_gap_um = 70'000;
    moved = std::min(bytes.size(), kReferenceLongBlockBytes);
    if (moved == kReferenceLongBlockBytes) encode(block, bytes.first<kReferenceLongBlockBytes>());
    return HalStatus::kOk;
  }
  [[nodiscard]] std::int64_t next_report_ns() const noexcept override { return due_ns_; }
  std::size_t report(std::int64_t now_ns, std::span<std::uint8_t> bytes,
                     std::int64_t&) noexcept override {
    if (now_ns < due_ns_) return 0;
    due_ns_ = now_ns + kGripPeriod_ns;
    ReferenceReport r;
    r.sequence = ++reports;
    r.status = kReferenceCalibrated;
    if (last.drives_on) r.status |= kReferenceDrivesOn;
    r.accepted_sequence = last.sequence;
    r.accepted_tick = last.tick;
    r.gripper = gripper;
    r.switches = switches;
    encode(r, bytes.first<kReferenceReportBytes>());
    return kReferenceReportBytes;
  }
  void command(std::int64_t, std::span<const std::uint8_t> bytes) noexcept override {
    (void)decode(bytes, last);
  }

  std::uint32_t gripper = 40'001, switches = 0, reports = 0;
  ReferenceCommand last;

 private:
  std::int64_t due_ns_ = 0;
};

LinkSettings gripper_link(const GripperSettings& grip) {
  LinkSettings settings;
  settings.limits = limits_of(reference_capabilities(), kGripPeriod_ns);
  settings.retry_ns = 0;
  settings.gripper = grip;
  settings.deadman = grip.is_used() ? kClosedGripper : 0;
  return settings;
}

struct GripperBench {
  explicit GripperBench(const GripperSettings& grip = kGrip)
      : link(driver, mailbox, peer, gripper_link(grip)) {}
  void turn(double force_n, unsigned arming) {
    command.tick += 1;
    command.stamp_ns = monotonic_ns();
    command.sequence = servo.state().sequence;
    command.wrench_d.force_n[2] = static_cast<Real>(force_n);
    command.arming = arming;
    servo.publish(command);
    (void)link.poll(kGripPeriod_ns / 2);
  }
  /// Turns until two reports more were read.
  void settle(double force_n = 0, unsigned arming = 0) {
    const std::uint32_t until = peer.reports + 3;
    for (int k = 0; k < kMostGripTurns && peer.reports < until; ++k) turn(force_n, arming);
    REQUIRE(peer.reports >= until);
  }
  [[nodiscard]] bool closed() { return (servo.state().switches & kClosedGripper) != 0; }
  [[nodiscard]] double force_n() const { return peer.last.force[2] * kReferenceForceUnit_n; }

  GripperPeer peer;
  ReferenceDriver driver;
  MailboxMemory mailbox;
  ServoSide servo{mailbox};
  LocalLink link;
  DeviceCommand command;
};

}  // namespace

TEST_SUITE("hal.gripper_switch") {
  TEST_CASE("closed at one gap, open at another, between them as before") {
    GripperSwitch grip(kGrip);
    CHECK_FALSE(grip.closed(0.0065_r));
    CHECK(grip.closed(0.005_r));
    CHECK(grip.closed(0.0079_r));
    CHECK_FALSE(grip.closed(0.008_r));
    CHECK_FALSE(grip.closed(0.0051_r));
    CHECK(grip.closed(0.0_r));
    grip.open();
    CHECK_FALSE(grip.closed(0.0065_r));
  }

  TEST_CASE("a gap that is not measured or no number is open, and so is a gripper of no use") {
    constexpr Real kNan = std::numeric_limits<Real>::quiet_NaN();
    GripperSwitch grip(kGrip);
    REQUIRE(grip.closed(0.001_r));
    CHECK_FALSE(grip.closed(std::nullopt));
    CHECK_FALSE(grip.closed(0.0065_r));
    REQUIRE(grip.closed(0.001_r));
    CHECK_FALSE(grip.closed(kNan));
    CHECK_FALSE(grip.closed(std::numeric_limits<Real>::infinity()));
    GripperSwitch none(GripperSettings{});
    CHECK_FALSE(none.closed(0.0_r));
  }

  TEST_CASE("link: a closed gripper is a switch of the state, and the gap is there to be read") {
    GripperBench b;
    CHECK_FALSE(b.link.gap_m());
    b.settle();
    REQUIRE(b.link.gap_m());
    CHECK(*b.link.gap_m() == doctest::Approx(0.04));
    CHECK_FALSE(b.closed());
    b.peer.switches = kClosedGripper | 1u;  // the device's own bit of that place is not believed
    b.settle();
    CHECK_FALSE(b.closed());
    CHECK((b.servo.state().switches & 1u) != 0);
    b.peer.gripper = 4'001;
    b.settle();
    CHECK(b.closed());
    b.peer.gripper = 7'001;
    b.settle();
    CHECK(b.closed());
    b.peer.gripper = 70'002;  // beyond its largest: the report is refused, nothing changes
    b.settle();
    CHECK(b.closed());
    CHECK(b.link.counters().bad_number > 0);
    b.peer.gripper = 0;  // not measured
    b.settle();
    CHECK_FALSE(b.closed());
    CHECK_FALSE(b.link.gap_m());
    b.link.close();

    GripperBench none(GripperSettings{});
    none.peer.gripper = 1;
    none.peer.switches = kClosedGripper;
    none.settle();
    CHECK(none.closed());  // a switch of the device like any other
    CHECK(*none.link.gap_m() == 0);
    none.link.close();
  }

  TEST_CASE("link: a gripper that opens as the deadman switch takes the force away") {
    GripperBench b;
    b.peer.gripper = 1;
    for (int k = 0; k < kMostGripTurns && b.link.state() != LinkState::kReady; ++k) b.turn(0, 0);
    for (int k = 0; k < 20; ++k) b.turn(0, 0);  // until the drives are on
    for (unsigned k = 0; k < kMostGripTurns && b.force_n() < 1.999; ++k) b.turn(2.0, 1 + k / 500);
    CHECK(b.force_n() == doctest::Approx(2.0).epsilon(1e-3));
    const unsigned arming = b.command.arming;
    b.peer.gripper = 9'001;
    for (int k = 0; k < kMostGripTurns && b.force_n() > 0; ++k) b.turn(2.0, arming);
    CHECK(b.force_n() == 0);
    for (int k = 0; k < 20; ++k) b.turn(2.0, arming);
    CHECK(b.force_n() == 0);
    b.peer.gripper = 1;  // closed again: not before the operator has armed
    b.settle(2.0, arming);
    CHECK(b.force_n() == 0);
    for (unsigned k = 0; k < kMostGripTurns && b.force_n() < 1.999; ++k)
      b.turn(2.0, arming + 1 + k / 500);
    CHECK(b.force_n() == doctest::Approx(2.0).epsilon(1e-3));
    b.peer.gripper = 0;  // no longer measured
    for (int k = 0; k < kMostGripTurns && b.force_n() > 0; ++k) b.turn(2.0, b.command.arming);
    CHECK(b.force_n() == 0);
    b.link.close();
  }
}
