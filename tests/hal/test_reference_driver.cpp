// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <limits>

#include "tests/hal/reference_bench.hpp"

using namespace haptic;
using namespace haptic::hal;
using namespace haptic::hal::test;

TEST_SUITE("hal.reference_driver") {
  TEST_CASE("start: takes the limits that the device states, keeps the frames of the settings") {
    AnsweringPort port;
    port.block.max_force = 450'000;
    port.block.driven_dof = kDofTranslation;
    port.block.max_torque = 0;
    port.block.watchdog_ms = 50;
    port.damaged_answers = 2;
    ReferenceSettings settings;
    settings.capabilities.handle_offset_h = Vec3(0, 0, 0.25_r);
    ReferenceDriver driver(settings);
    CHECK(driver.start(port) == HalStatus::kOk);
    CHECK(port.asked == 3);
    CHECK(port.last.request_type == 0xc1);
    CHECK(port.last.request == 1);
    CHECK(port.last.value == 1);
    CHECK(port.last_timeout_ms <= 100);
    const DeviceCapabilities& c = driver.capabilities();
    CHECK(static_cast<double>(c.max_force_n) == doctest::Approx(4.5));
    CHECK(c.driven_dof == kDofTranslation);
    CHECK(c.watchdog_ns == 50'000'000);
    CHECK(c.handle_offset_h.z() == 0.25_r);
  }

  TEST_CASE("start: refuses damaged and implausible answers, silence and a stop") {
    const auto outcome = [](auto change) {
      AnsweringPort port;
      change(port);
      ReferenceDriver driver;
      const HalStatus status = driver.start(port);
      CHECK(port.asked <= 3);
      CHECK(static_cast<double>(driver.capabilities().max_force_n) == doctest::Approx(12.0));
      return status;
    };
    CHECK(outcome([](auto& p) { p.damaged_answers = 3; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.longest = 63; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.status = HalStatus::kTransferFailed; }) ==
          HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.status = HalStatus::kTimeout; }) == HalStatus::kTimeout);
    CHECK(outcome([](auto& p) { p.status = HalStatus::kDeviceGone; }) == HalStatus::kDeviceGone);
    CHECK(outcome([](auto& p) { p.stop = true; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.max_force = 0; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.max_force = 100'100'000; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.max_torque = 0; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.sensed_dof = kDofTranslation; }) ==
          HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.watchdog_ms = 0; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.watchdog_ms = 1; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.report_period_us = 99; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.encoder_step_nm = 1'000'000; }) == HalStatus::kStartFailed);
  }

  TEST_CASE("start: a device of 1.0 answers by its own block, or is asked for it after a stall") {
    for (const std::size_t longest_known : {std::size_t{4096}, kReferenceBlockBytes}) {
      AnsweringPort port;
      port.longest_known = longest_known;
      port.block.max_force = 450'000;
      ReferenceDriver driver;
      CHECK(driver.start(port) == HalStatus::kOk);
      CHECK(port.asked == (longest_known == kReferenceBlockBytes ? 2 : 1));
      CHECK(static_cast<double>(driver.capabilities().max_force_n) == doctest::Approx(4.5));
      CHECK(driver.capabilities().latency_ns == 0);
      CHECK(text_of(driver.capabilities().name).empty());
    }
  }

  TEST_CASE("start: a device of 1.1 says its name, serial number, latency, gap and kind") {
    AnsweringPort port;
    port.long_block.emplace();
    port.long_block->latency_us = 1500;
    port.long_block->largest_gap_um = 70'000;
    port.long_block->name = device_text("Desk arm");
    port.long_block->serial = device_text("007");
    ReferenceDriver driver;
    REQUIRE(driver.start(port) == HalStatus::kOk);
    const DeviceCapabilities& c = driver.capabilities();
    CHECK(c.latency_ns == 1'500'000);
    CHECK(static_cast<double>(c.largest_gap_m) == doctest::Approx(0.07));
    CHECK(text_of(c.name) == "Desk arm");
    CHECK(text_of(c.serial) == "007");
    CHECK_FALSE(c.is_displacement);
    const auto outcome = [&](auto change) {
      AnsweringPort other = port;
      change(*other.long_block);
      return ReferenceDriver().start(other);
    };
    CHECK(outcome([](auto& b) { b.latency_us = 100'000; }) == HalStatus::kOk);
    CHECK(outcome([](auto& b) { b.latency_us = 100'001; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& b) { b.latency_us = 0xffff'ffff; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& b) { b.largest_gap_um = 1'000'001; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& b) { b.name.fill('n'); }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& b) { b.serial[0] = '\x1b'; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& b) { b.is_displacement = true; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& b) {
            b.is_displacement = true;
            b.first.driven_dof = 0;
          }) == HalStatus::kOk);
    CHECK(outcome([](auto& b) { b.first.max_force = 0; }) == HalStatus::kStartFailed);
  }

  TEST_CASE("read: what 1.1 adds is refused from a device that has not stated it") {
    ReferenceBench old;
    CHECK(old.report() == ReportVerdict::kState);
    old.device.gripper = 1;
    CHECK(old.report() == ReportVerdict::kBadCheck);
    old.device.gripper = 0;
    old.set(kReferenceSlewing);
    CHECK(old.report() == ReportVerdict::kBadCheck);
    old.unset(kReferenceSlewing);
    CHECK(old.report() == ReportVerdict::kState);
    CHECK_FALSE(old.driver.gap_m());

    ReferenceLongBlock block;
    block.largest_gap_um = 70'000;
    ReferenceBench bench(block);
    CHECK(bench.report() == ReportVerdict::kState);
    CHECK_FALSE(bench.driver.gap_m());
    bench.set(kReferenceSlewing);
    bench.device.gripper = 25'001;
    CHECK(bench.report() == ReportVerdict::kState);
    REQUIRE(bench.driver.gap_m());
    CHECK(static_cast<double>(*bench.driver.gap_m()) == doctest::Approx(0.025));
    bench.device.gripper = 1;
    CHECK(bench.report() == ReportVerdict::kState);
    CHECK(static_cast<double>(*bench.driver.gap_m()) == 0);
    for (const std::uint32_t beyond : {70'002u, 0xffff'ffffu}) {
      bench.device.gripper = beyond;
      CHECK(bench.report() == ReportVerdict::kBadNumber);
    }
    bench.device.gripper = 0;
    CHECK(bench.report() == ReportVerdict::kState);
    CHECK_FALSE(bench.driver.gap_m());
  }

  TEST_CASE("start: without asking, the settings' own limits are checked") {
    AnsweringPort port;
    ReferenceSettings settings;
    settings.ask_device = false;
    ReferenceDriver good(settings);
    CHECK(good.start(port) == HalStatus::kOk);
    CHECK(port.asked == 0);
    settings.capabilities.max_force_n = std::numeric_limits<Real>::quiet_NaN();
    ReferenceDriver bad(settings);
    CHECK(bad.start(port) == HalStatus::kBadCapabilities);
  }

  TEST_CASE("read: units, frames and switches") {
    ReferenceBench bench;
    bench.set(kReferenceCalibrated);
    bench.set(kReferenceTwistValid);
    bench.device.position = {12'345'678, -4'000'000, 30'000'000};
    bench.device.orientation = {0, 0, 759'250'125, 759'250'125};
    bench.device.velocity = {100'000, 0, -50'000};
    bench.device.angular_velocity = {0, 0, 1'000'000};
    bench.device.switches = 5;
    REQUIRE(bench.report() == ReportVerdict::kState);
    const Pose pose = pose_of(bench.state.pose_dh);
    const double tolerance = 16 * static_cast<double>(kRealEpsilon);
    CHECK(static_cast<double>(pose.p_wa.x()) == doctest::Approx(0.012345678).epsilon(tolerance));
    CHECK(static_cast<double>(pose.p_wa.y()) == doctest::Approx(-0.004).epsilon(tolerance));
    CHECK(static_cast<double>(pose.p_wa.z()) == doctest::Approx(0.03).epsilon(tolerance));
    // H's x axis lies along D's y axis.
    CHECK(static_cast<double>((pose.q_wa * Vec3(1, 0, 0)).y()) ==
          doctest::Approx(1.0).epsilon(tolerance));
    CHECK(bench.state.twist_valid);
    CHECK(static_cast<double>(bench.state.twist_d.linear_m_per_s[2]) == doctest::Approx(-0.05));
    CHECK(static_cast<double>(bench.state.twist_d.angular_rad_per_s[2]) == doctest::Approx(1.0));
    CHECK(bench.state.switches == 5);
    CHECK(bench.state.link == LinkState::kReady);
    CHECK(bench.state.faults == 0);
    bench.unset(kReferenceTwistValid);
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK_FALSE(bench.state.twist_valid);
    CHECK(bench.state.twist_d.linear_m_per_s[0] == 0);
  }

  TEST_CASE("read: an orientation that is only nearly unit comes out unit") {
    ReferenceBench bench;
    bench.device.orientation = {0, 0, 0, (1 << 30) - (1 << 20)};
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.pose_dh.q_xyzw[3] == 1);
  }

  TEST_CASE("read: what is refused leaves the state as it was, with the reason") {
    ReferenceBench bench;
    bench.device.position = {1, 2, 3};
    REQUIRE(bench.report() == ReportVerdict::kState);
    const PoseRecord before = bench.state.pose_dh;
    bench.device.position = {9, 9, 9};
    CHECK(bench.repeat_report() == ReportVerdict::kNotAdvancing);
    --bench.device.sequence;
    CHECK(bench.repeat_report() == ReportVerdict::kNotAdvancing);
    bench.device.sequence += 10;
    std::array<std::uint8_t, kReferenceReportBytes> bytes{};
    encode(bench.device, bytes);
    CHECK(bench.driver.read(std::span(bytes).first(95), 0, bench.state) ==
          ReportVerdict::kBadLength);
    CHECK(bench.driver.read({}, 0, bench.state) == ReportVerdict::kBadLength);
    bytes[50] ^= 4;
    CHECK(bench.driver.read(bytes, 0, bench.state) == ReportVerdict::kBadCheck);
    bench.device.orientation = {0, 0, 0, 1 << 29};
    CHECK(bench.repeat_report() == ReportVerdict::kBadNumber);
    for (int k = 0; k < 3; ++k) CHECK(bench.state.pose_dh.p_m[k] == before.p_m[k]);
    bench.device.orientation = {0, 0, 0, 1 << 30};
    CHECK(bench.repeat_report() == ReportVerdict::kState);
  }

  TEST_CASE("read: the sequence may wrap, may skip, and is forgotten by start") {
    ReferenceBench bench;
    bench.device.sequence = 0xffff'fffd;
    for (int k = 0; k < 6; ++k) CHECK(bench.report() == ReportVerdict::kState);
    CHECK(bench.device.sequence == 3);
    bench.device.sequence += 1000;
    CHECK(bench.repeat_report() == ReportVerdict::kState);
    bench.device.sequence -= 1;
    CHECK(bench.repeat_report() == ReportVerdict::kNotAdvancing);
    REQUIRE(bench.driver.start(bench.port) == HalStatus::kOk);
    bench.device.sequence = 1;
    CHECK(bench.repeat_report() == ReportVerdict::kState);
  }

  TEST_CASE("read: fault bits of the device pass, a fault bit alone stops as its status bit does") {
    ReferenceBench bench;
    bench.bring_up();
    bench.device.faults = kDeviceOverheated;
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.faults == kDeviceOverheated);
    REQUIRE(bench.command(push(1, 0, 0)) == kReferenceCommandBytes);
    CHECK_FALSE(is_zero(bench.delivered));
    bench.device.faults = kDeviceEmergencyStop;
    REQUIRE(bench.report() == ReportVerdict::kState);
    REQUIRE(bench.command(push(1, 0, 0)) == kReferenceCommandBytes);
    CHECK_FALSE(bench.sent.drives_on);
    CHECK(is_zero(bench.delivered));
    bench.device.faults = kDeviceNotHomed;
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.link == LinkState::kStarting);
  }

  TEST_CASE("read: a refused command is a fault until a newer one was accepted") {
    ReferenceBench bench;
    bench.device.rejected = 17;  // of an earlier program
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.faults == 0);
    ++bench.device.rejected;
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.faults == kDeviceRefused);
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.faults == kDeviceRefused);
    REQUIRE(bench.command({}) == kReferenceCommandBytes);
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.faults == 0);
  }
}
