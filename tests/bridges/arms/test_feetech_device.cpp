// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "tests/bridges/arms/arm_bench.hpp"
#include "tests/bridges/arms/feetech_emulator.hpp"
#include "tests/support/text_search.hpp"
#include "tools/bridges/feetech/feetech_device.hpp"

using namespace haptic;
using namespace haptic::tools;
using hal::BridgeRead;
using hal::BridgeSample;
using test::FeetechEmulator;
using test::has;

namespace {

std::string feetech_refusal(FeetechEmulator& bus) {
  FeetechDevice device(test::leader_settings(bus.path()));
  std::string why;
  CHECK_FALSE(device.open(why));
  return why;
}

}  // namespace

TEST_SUITE("bridges.feetech_device") {
  TEST_CASE("open and read: poses, the trigger, across the end of a turn, and nothing is written") {
    FeetechEmulator bus(7);
    FeetechDevice device(test::leader_settings(bus.path(), true));
    std::string why;
    REQUIRE(device.open(why));
    CHECK(device.facts().capabilities.driven_dof == 0);
    CHECK(device.facts().capabilities.sensed_dof == hal::kDofAll);
    CHECK(has(device.facts().words, "no current mode and no watchdog"));
    BridgeSample sample;
    BridgeRead last = BridgeRead::kSilent;
    const Wrench push{Vec3(1, 0, 0), Vec3::Zero()};
    // Joint 1 up to its servo's 4095, 0, 40: 2088 steps in one sense.
    for (const int counts : {2048, 3000, 4000, 4090, 40}) {
      bus.with([&](auto& b) { FeetechEmulator::turn(b.servo(1), counts); });
      test::read_for(device, sample, 40, &push);
    }
    JointNumbers angles{};
    angles[0] = 2088 * kCountStep_rad;
    const Pose pose = pose_of(place_of(test::leader_settings("").arm.model, angles));
    for (int k = 0; k < 4; ++k)
      CHECK(sample.pose_dh.q_xyzw[k] == doctest::Approx(pose.q_wa.coeffs()[k]).epsilon(1e-9));
    CHECK(sample.calibrated);
    CHECK_FALSE(sample.twist_valid);
    CHECK(sample.faults == 0);
    bus.with([](auto& b) {
      FeetechEmulator::turn(b.servo(7), 2048 + 260);
      b.servo(2).error = 0x04;
    });
    CHECK(test::read_until(device, sample, last, [&] {
      return sample.switches == 1 && sample.faults == kDeviceOverheated;
    }));
    CHECK(device.release(test::steady_ns()));
    device.close();
    bus.with([](auto& b) { CHECK(b.writes == 0); });
  }

  TEST_CASE("answers: one damaged costs a sample, 100 ms without one the device, so does a pull") {
    FeetechEmulator bus(6);
    BridgeSample sample;
    BridgeRead last = BridgeRead::kSilent;
    std::string why;
    FeetechDevice device(test::leader_settings(bus.path()));
    REQUIRE(device.open(why));
    bus.with([](auto& b) { b.damage = 1; });
    CHECK(test::read_for(device, sample, 60) != BridgeRead::kLost);
    CHECK(device.cycles().missed >= 1);
    bus.with([](auto& b) { b.servo(3).silent = true; });
    CHECK_FALSE(test::read_until(
        device, sample, last, [] { return false; }, 1000));
    CHECK(last == BridgeRead::kLost);
    device.close();
    CHECK(has(feetech_refusal(bus), "servo 3 (joint 'j2') does not answer at 1000000 baud"));
    bus.with([](auto& b) { b.servo(3).silent = false; });
    REQUIRE(device.open(why));
    bus.pull();
    CHECK(device.read(test::steady_ns(), sample) == BridgeRead::kLost);
  }

  TEST_CASE("an answer that comes late is not taken for that of the newest question") {
    FeetechEmulator bus(6);
    FeetechDevice device(test::leader_settings(bus.path()));
    std::string why;
    REQUIRE(device.open(why));
    CHECK(test::samples_of_other_questions(bus, device) == 0);
    CHECK(device.cycles().missed > 0);
  }

  TEST_CASE("open: a servo that holds its position is named, and not let go") {
    FeetechEmulator bus(6);
    bus.with([](auto& b) { b.servo(5).table[40] = 1; });
    CHECK(has(feetech_refusal(bus), "servo 5 (joint 'j4') holds its position, and a leader arm"));
    bus.with([](auto& b) { CHECK(b.writes == 0); });
  }
}
