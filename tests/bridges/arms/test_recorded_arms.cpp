// SPDX-License-Identifier: Apache-2.0
// Sessions on emulated servo buses, kept and replayed without a port.
#include <doctest/doctest.h>

#include "tests/bridges/arms/arm_bench.hpp"
#include "tests/bridges/arms/dynamixel_emulator.hpp"
#include "tests/bridges/arms/feetech_emulator.hpp"
#include "tests/bridges/record_bench.hpp"
#include "tests/support/text_search.hpp"
#include "tools/bridges/dynamixel/dynamixel_device.hpp"
#include "tools/bridges/feetech/feetech_device.hpp"

using namespace haptic;
using namespace haptic::test;
using hal::BridgeRead;
using hal::TapKind;

namespace {

tools::ReplayResult replay_arm(const std::string& path, hal::BridgedDevice&& device) {
  tools::Recording recording(path);
  return tools::replay_calls(recording, device);
}

tools::DynamixelSettings arm_settings(const std::string& port) {
  tools::DynamixelSettings settings;
  settings.arm = leader_settings(port);
  settings.torque_limits_nm = {0.9, 0.9, 0.9, 0.5, 0.5, 0.5};
  return settings;
}

void record_dynamixel(RecordBench& bench) {
  DynamixelEmulator bus(6, 1220);
  auto device = bench.recorded(std::make_unique<tools::DynamixelDevice>(arm_settings(bus.path())));
  std::string why;
  hal::BridgeSample sample;
  const Wrench push{Vec3(0.2_r, 0, 0), Vec3::Zero()};
  REQUIRE(device->open(why));
  for (int k = 0; k < 6; ++k) {
    bus.with([&](auto& b) { DynamixelEmulator::set(b.servo(2), 132, 4, 2048 + 40 * k); });
    (void)read_for(*device, sample, 40, k > 2 ? &push : nullptr);
  }
  bus.with([](auto& b) { b.damage = 1; });
  (void)read_for(*device, sample, 40);
  for (int k = 0; k < 50 && !device->release(steady_ns()); ++k) (void)read_for(*device, sample, 2);
  device->close();
  device.reset();
  bench.recorder.reset();
}

void record_feetech(RecordBench& bench) {
  FeetechEmulator bus(7);
  auto device =
      bench.recorded(std::make_unique<tools::FeetechDevice>(leader_settings(bus.path(), true)));
  std::string why;
  hal::BridgeSample sample;
  REQUIRE(device->open(why));
  for (const int counts : {2048, 3000, 4000, 4090, 40}) {
    bus.with([&](auto& b) { FeetechEmulator::turn(b.servo(1), counts); });
    (void)read_for(*device, sample, 40);
  }
  bus.with([](auto& b) { b.damage = 1; });
  (void)read_for(*device, sample, 40);
  bus.pull();
  CHECK(read_for(*device, sample, 400) == BridgeRead::kLost);
  device->close();
  CHECK_FALSE(device->open(why));
  device.reset();
  bench.recorder.reset();
}

}  // namespace

TEST_SUITE("bridges.recorded_arms") {
  TEST_CASE("an arm that pushes gives its poses and its currents again to the bit") {
    RecordBench bench("recorded_dynamixel");
    record_dynamixel(bench);
    CHECK(bench.count(TapKind::kSent) > 100);
    check_same(replay_arm(bench.path, tools::DynamixelDevice(arm_settings("recorded"))), 60);
    // Other code, here another share of the weight, says something else to the servos.
    tools::DynamixelSettings other = arm_settings("recorded");
    other.gravity_share = 0.5;
    CHECK(has(replay_arm(bench.path, tools::DynamixelDevice(other)).first,
              "says something else to the device"));
    REQUIRE(bench.turn_bit(TapKind::kLooked, 8));
    const tools::ReplayResult changed =
        replay_arm(bench.path, tools::DynamixelDevice(arm_settings("recorded")));
    CHECK(changed.different == 1);
    CHECK(has(changed.first, "another pose than then"));
  }

  TEST_CASE("a byte changed anywhere: the replay ends, with a result or a refusal") {
    RecordBench bench("mutated_arms");
    record_dynamixel(bench);
    check_mutations(
        bench,
        [](const std::string& path) {
          return replay_arm(path, tools::DynamixelDevice(arm_settings("recorded")));
        },
        60);
    RecordBench other("mutated_feetech");
    record_feetech(other);
    check_mutations(
        other,
        [](const std::string& path) {
          return replay_arm(path, tools::FeetechDevice(leader_settings("recorded", true)));
        },
        60);
  }

  TEST_CASE("an arm without force, a damaged answer, the adapter pulled") {
    RecordBench bench("recorded_feetech");
    record_feetech(bench);
    CHECK(bench.count(TapKind::kOpened) == 2);
    check_same(replay_arm(bench.path, tools::FeetechDevice(leader_settings("recorded", true))), 40);
    // Without its trigger it asks one servo less.
    CHECK(has(replay_arm(bench.path, tools::FeetechDevice(leader_settings("recorded"))).first,
              bench.path + ": byte "));
  }
}
