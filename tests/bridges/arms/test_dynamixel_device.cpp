// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "tests/bridges/arms/arm_bench.hpp"
#include "tests/bridges/arms/dynamixel_emulator.hpp"
#include "tests/support/text_search.hpp"
#include "tools/bridges/dynamixel/dynamixel_device.hpp"

using namespace haptic;
using namespace haptic::tools;
using hal::BridgeRead;
using hal::BridgeSample;
using test::DynamixelEmulator;
using test::has;

namespace {

constexpr int kXc330 = 1220;
constexpr std::int64_t kMs = 1'000'000;

DynamixelSettings dynamixel_settings(const DynamixelEmulator& bus, bool has_trigger = false) {
  DynamixelSettings settings;
  settings.arm = test::leader_settings(bus.path(), has_trigger);
  settings.torque_limits_nm = {0.9, 0.9, 0.9, 0.5, 0.5, 0.5};
  return settings;
}

std::string refusal_of(const DynamixelSettings& settings) {
  DynamixelDevice device(settings);
  std::string why;
  CHECK_FALSE(device.open(why));
  return why;
}

/// An open arm that runs: torque and watchdogs on.
struct RunningArm {
  explicit RunningArm(const DynamixelSettings& settings) : device(settings) {
    std::string why;
    const bool is_open = device.open(why);
    CAPTURE(why);
    REQUIRE(is_open);
    REQUIRE(test::read_until(device, sample, last,
                             [&] { return last == BridgeRead::kNew && sample.calibrated; }));
  }
  DynamixelDevice device;
  BridgeSample sample;
  BridgeRead last = BridgeRead::kSilent;
};

int largest_step(const std::vector<DynamixelEmulator::Goals>& goals, std::size_t from) {
  int worst = 0;
  for (std::size_t k = std::max<std::size_t>(from, 1); k < goals.size(); ++k)
    for (const auto& [id, current] : goals[k].current)
      worst = std::max(worst, std::abs(current - goals[k - 1].current.at(id)));
  return worst;
}

}  // namespace

TEST_SUITE("bridges.dynamixel_device") {
  TEST_CASE("open and read: no torque before the first read, then watchdog, poses, the trigger") {
    DynamixelEmulator bus(7, kXc330);
    bus.with([](auto& b) { DynamixelEmulator::set(b.servo(2), 132, 4, 2048 + 300); });
    {
      DynamixelDevice device(dynamixel_settings(bus, true));
      std::string why;
      REQUIRE(device.open(why));
      bus.with([](auto& b) {
        CHECK(b.servo(1).table[64] == 0);
        CHECK(b.servo(1).table[11] == 0);
        CHECK(b.servo(7).table[11] == 3);  // the trigger is left as it is
      });
      const hal::DeviceCapabilities& c = device.facts().capabilities;
      CHECK(hal::check_capabilities(c) == hal::HalStatus::kOk);
      CHECK(c.sensed_dof == hal::kDofAll);
      CHECK(c.driven_dof == hal::kDofAll);
      CHECK(c.max_force_n > 0.1);
      CHECK(c.max_stiffness_n_per_m == 0);
      CHECK(c.report_period_ns >= 2'500'000);
      CHECK(has(device.facts().words, "a cue, not a surface"));
      CHECK(has(device.facts().words, "the servos cut after 20 ms and the arm falls"));
      CHECK(has(device.facts().name, "XC330-T288"));
      BridgeSample sample;
      BridgeRead last = BridgeRead::kSilent;
      REQUIRE(test::read_until(device, sample, last,
                               [&] { return last == BridgeRead::kNew && sample.calibrated; }));
      bus.with([](auto& b) {
        for (int id = 1; id <= 6; ++id) {
          CHECK(b.servo(id).table[64] == 1);
          CHECK(b.servo(id).table[98] == 1);
          CHECK(b.current(id) == 0);
        }
        CHECK(b.servo(7).table[64] == 0);
      });
      // Servo 2 turns against its joint; base_rpy_deg has not been asked for here, D is B.
      JointNumbers angles{};
      angles[1] = -300 * kCountStep_rad;
      const Pose pose = pose_of(place_of(dynamixel_settings(bus).arm.arm.model, angles));
      for (int k = 0; k < 3; ++k)
        CHECK(sample.pose_dh.p_m[k] == doctest::Approx(pose.p_wa[k]).epsilon(1e-9));
      CHECK(sample.switches == 0);
      bus.with([](auto& b) { DynamixelEmulator::set(b.servo(7), 132, 4, 2048 + 260); });
      CHECK(test::read_until(device, sample, last, [&] { return sample.switches == 1; }));
      CHECK(device.cycles().answered > 0);
      CHECK(device.release(test::steady_ns()));
    }
    bus.with([](auto& b) {
      for (int id = 1; id <= 6; ++id) {
        CHECK(b.servo(id).table[64] == 0);
        CHECK(b.servo(id).table[98] == 0);
        CHECK(b.servo(id).table[11] == 3);  // as it was found
      }
    });
  }

  TEST_CASE("write: currents are J^T of the wrench, never beyond a limit, none for no number") {
    DynamixelEmulator bus(6, kXc330);
    DynamixelSettings settings = dynamixel_settings(bus);
    settings.gravity_share = 0;
    RunningArm arm(settings);
    const Wrench wrench{Vec3(0, 0.4, -0.3), Vec3(0.01, 0, 0.02)};
    const JointNumbers torques =
        torques_of(place_of(settings.arm.arm.model, {}), wrench.force_w.cast<double>(),
                   wrench.torque_w.cast<double>());
    const auto off = [&] {
      return bus.with([&](auto& b) {
        double worst = 0;
        for (std::size_t k = 0; k < 6; ++k) {
          const double right = settings.arm.signs[k] * torques[k] / 1.15 / 0.001;
          worst = std::max(worst, std::abs(b.current(static_cast<int>(k) + 1) - right));
        }
        return worst;
      });
    };
    CHECK(off() > 100);
    CHECK(test::read_until(
        arm.device, arm.sample, arm.last, [&] { return off() <= 0.51; }, 3000, &wrench));
    const Wrench huge{Vec3(1e6, -1e6, 1e6), Vec3::Zero()};
    int most = 0;
    CHECK(test::read_until(
        arm.device, arm.sample, arm.last,
        [&] {
          return bus.with([&](auto& b) {
            for (int id = 1; id <= 6; ++id) {
              const double limit = settings.torque_limits_nm[static_cast<std::size_t>(id) - 1];
              CHECK(std::abs(b.current(id)) <= limit / 1.15 / 0.001 + 0.5);
              most = std::max(most, std::abs(b.current(id)));
            }
            return most > 700;
          });
        },
        3000, &huge));
    bus.with([](auto& b) { CHECK(b.rejected_goals == 0); });
    const Wrench none{Vec3(std::nan(""), 0, 0), Vec3::Zero()};
    CHECK(test::read_until(
        arm.device, arm.sample, arm.last,
        [&] {
          return bus.with([](auto& b) {
            int sum = 0;
            for (int id = 1; id <= 6; ++id) sum += std::abs(b.current(id));
            return sum == 0;
          });
        },
        1000, &none));
  }

  TEST_CASE("the end: the wrench goes at once, the weight over a second, and no step is a jump") {
    DynamixelEmulator bus(6, kXc330);
    const DynamixelSettings settings = dynamixel_settings(bus);
    RunningArm arm(settings);
    const Wrench push{Vec3(0, 0, 0.3), Vec3::Zero()}, rest;
    // All of its weight from 1 s after the first command on. 0.3 N over 0.37 m are 97 counts.
    const double weight = weight_torques(place_of(settings.arm.arm.model, {}))[1];
    const int carried = static_cast<int>(std::lround(-weight / 1.15 / 0.001));
    CHECK(std::abs(carried) > 300);
    const std::int64_t driven = test::steady_ns();
    CHECK(test::read_until(
        arm.device, arm.sample, arm.last,
        [&] { return bus.with([&](auto& b) { return b.current(2) == carried; }); }, 5000, &rest));
    CHECK(test::steady_ns() - driven > 900 * kMs);
    CHECK(test::read_until(
        arm.device, arm.sample, arm.last,
        [&] { return bus.with([&](auto& b) { return std::abs(b.current(2) - carried) > 90; }); },
        3000, &push));
    const bool at_once = arm.device.release(test::steady_ns());
    CHECK((at_once || test::read_until(
                          arm.device, arm.sample, arm.last,
                          [&] { return arm.device.release(test::steady_ns()); }, 500)));
    test::read_for(arm.device, arm.sample, 100);
    const std::size_t from = bus.with([](auto& b) { return b.goals.size(); });
    CHECK(bus.with([&](auto& b) { return std::abs(b.current(2) - carried); }) <= 1);
    const std::int64_t begun = test::steady_ns();
    arm.device.close();
    const std::int64_t took = test::steady_ns() - begun;
    CHECK(took > 900 * kMs);
    CHECK(took < 5000 * kMs);
    bus.with([&](auto& b) {
      REQUIRE(b.goals.size() > from + 20);
      // In even steps: a tenth of it at once would be a fall.
      CHECK(largest_step(b.goals, from) < std::abs(carried) / 10);
      CHECK(b.goals.back().current.at(2) == 0);
      CHECK(b.servo(2).table[64] == 0);
      for (const int id : {1, 2, 3, 4, 5, 6}) CHECK(b.servo(id).cuts == 0);
    });
  }

  TEST_CASE("watchdog: a program that stops is cut, says so, and comes back from nothing") {
    DynamixelEmulator bus(6, kXc330);
    RunningArm arm(dynamixel_settings(bus));
    const Wrench push{Vec3(0, 0, 0.2), Vec3::Zero()};
    test::read_for(arm.device, arm.sample, 300, &push);
    bus.with([](auto& b) { b.watchdog_unit_ns = 20 * kMs; });
    std::this_thread::sleep_for(std::chrono::milliseconds(35));
    const std::size_t from = bus.with([](auto& b) {
      b.watchdog_unit_ns = 1000 * kMs;
      CHECK(b.servo(1).cuts == 1);
      CHECK(b.current(2) == 0);
      return b.goals.size();
    });
    std::uint32_t faults = 0;
    CHECK(test::read_until(
        arm.device, arm.sample, arm.last,
        [&] {
          if (arm.last == BridgeRead::kNew) faults |= arm.sample.faults;
          return arm.device.cycles().cuts == 1 && arm.sample.calibrated && faults != 0;
        },
        1000, &push));
    CHECK(faults == kDeviceDriveFault);
    test::read_for(arm.device, arm.sample, 200, &push);
    bus.with([&](auto& b) {
      CHECK(b.servo(1).table[98] == 1);
      CHECK(b.current(2) != 0);
      CHECK(largest_step(b.goals, from + 1) < 60);
    });
  }

  TEST_CASE("answers: one damaged costs a sample, 100 in a row the device, in 100 ms") {
    DynamixelEmulator bus(6, kXc330);
    DynamixelSettings settings = dynamixel_settings(bus);
    settings.gravity_share = 0;
    RunningArm arm(settings);
    const Wrench push{Vec3(0, 0, 0.5), Vec3::Zero()};
    test::read_for(arm.device, arm.sample, 200, &push);
    const std::uint64_t wrong = arm.device.cycles().wrong_check;
    bus.with([](auto& b) { b.damage = 1; });
    CHECK(test::read_for(arm.device, arm.sample, 100, &push) != BridgeRead::kLost);
    CHECK(arm.device.cycles().wrong_check == wrong + 1);
    bus.with([](auto& b) { b.damage = 100; });
    const std::int64_t begun = test::steady_ns();
    CHECK_FALSE(test::read_until(
        arm.device, arm.sample, arm.last, [] { return false; }, 1000, &push));
    CHECK(arm.last == BridgeRead::kLost);
    CHECK(test::steady_ns() - begun > 80 * kMs);
    CHECK(test::steady_ns() - begun < 300 * kMs);
    bus.with([&](auto& b) {
      int most = 0;
      for (const auto& [id, current] : b.goals[b.goals.size() / 2].current)
        most = std::max(most, std::abs(current));
      CHECK(most > 100);  // it pushed,
      for (const auto& [id, current] : b.goals.back().current)
        CHECK(current == 0);  // and had let go before it was lost
    });
  }

  TEST_CASE("an answer that comes late is not taken for that of the newest question") {
    DynamixelEmulator bus(6, kXc330);
    RunningArm arm(dynamixel_settings(bus));
    CHECK(test::samples_of_other_questions(bus, arm.device) == 0);
    CHECK(arm.device.cycles().missed > 0);
  }

  TEST_CASE("a servo that is missing: named at the start, lost in the run, the others let go") {
    DynamixelEmulator bus(6, kXc330);
    bus.with([](auto& b) { b.servo(4).silent = true; });
    CHECK(has(refusal_of(dynamixel_settings(bus)), "servo 4 (joint 'j3') does not answer"));
    bus.with([](auto& b) {
      b.servo(4).silent = false;
      CHECK(b.servo(1).table[11] == 3);
    });
    RunningArm arm(dynamixel_settings(bus));
    const Wrench rest;
    test::read_for(arm.device, arm.sample, 400, &rest);
    bus.with([](auto& b) { b.servo(4).silent = true; });
    CHECK_FALSE(test::read_until(
        arm.device, arm.sample, arm.last, [] { return false; }, 1000, &rest));
    CHECK(arm.last == BridgeRead::kLost);
    const std::size_t from = bus.with([](auto& b) { return b.goals.size(); });
    const std::int64_t begun = test::steady_ns();
    arm.device.close();
    CHECK(test::steady_ns() - begun < 3000 * kMs);
    bus.with([&](auto& b) {
      CHECK(b.goals.size() > from + 20);
      CHECK(b.current(2) == 0);
      CHECK(b.servo(2).table[64] == 0);
    });
  }

  TEST_CASE("alarms: overheated, or a drive fault for overload, voltage, shock and encoder") {
    DynamixelEmulator bus(6, kXc330);
    RunningArm arm(dynamixel_settings(bus));
    const auto faults_for = [&](std::uint8_t status) {
      bus.with([&](auto& b) { b.servo(3).table[70] = status; });
      test::read_for(arm.device, arm.sample, 60);
      return arm.sample.faults;
    };
    CHECK(faults_for(0) == 0);
    CHECK(faults_for(0x04) == kDeviceOverheated);
    CHECK(faults_for(0x20) == kDeviceDriveFault);
    CHECK(faults_for(0) == 0);
    CHECK(faults_for(0x01) == kDeviceDriveFault);
    CHECK(faults_for(0) == 0);
    CHECK(faults_for(0x24) == (kDeviceOverheated | kDeviceDriveFault));
  }

  TEST_CASE("a servo that has started again, and a cable that is out, are a lost device") {
    DynamixelEmulator bus(6, kXc330);
    {
      RunningArm arm(dynamixel_settings(bus));
      bus.with([](auto& b) { b.servo(5).table[64] = b.servo(5).table[98] = 0; });
      CHECK_FALSE(test::read_until(
          arm.device, arm.sample, arm.last, [] { return false; }, 500));
      CHECK(arm.last == BridgeRead::kLost);
    }
    RunningArm arm(dynamixel_settings(bus));
    bus.pull();
    CHECK(arm.device.read(test::steady_ns(), arm.sample) == BridgeRead::kLost);
    CHECK(arm.device.release(test::steady_ns()));
    const std::int64_t begun = test::steady_ns();
    arm.device.close();
    CHECK(test::steady_ns() - begun < 50 * kMs);
    CHECK(has(refusal_of(dynamixel_settings(bus)), "no such port; plug the adapter in"));
  }

  TEST_CASE("open: what does not fit is refused with its servo and a fix, and nothing is let go") {
    DynamixelEmulator bus(6, kXc330);
    bus.with([](auto& b) { b.servo(2).table[64] = 1; });  // in position mode
    CHECK(has(refusal_of(dynamixel_settings(bus)), "servo 2 (joint 'j1') holds its position, and"));
    bus.with([](auto& b) {
      CHECK(b.servo(2).table[64] == 1);
      b.servo(2).table[98] = 0xff;  // cut: it holds nothing
    });
    { RunningArm recovered(dynamixel_settings(bus)); }
    bus.with([](auto& b) {
      CHECK(b.servo(2).table[98] == 0);
      DynamixelEmulator::set(b.servo(1), 132, 4, 0);  // half a turn off
    });
    DynamixelSettings turned = dynamixel_settings(bus);
    turned.arm.arm.model.joints[0].lower_rad = -2;
    turned.arm.arm.model.joints[0].upper_rad = 2;
    CHECK(has(refusal_of(turned), "3.14 rad, outside its limits -2 to 2; correct offsets_rad or"));
    bus.with([](auto& b) { CHECK(b.servo(1).table[11] == 3); });

    DynamixelEmulator old(6, kXc330, 45);
    CHECK(has(refusal_of(dynamixel_settings(old)), "firmware 45, and fast sync read needs 46"));
    DynamixelEmulator plain(6, 1060);
    DynamixelSettings settings = dynamixel_settings(plain);
    CHECK(has(refusal_of(settings), "XL430-W250, has no current mode; set pose_only"));
    DynamixelEmulator unknown(6, 4242);
    CHECK(has(refusal_of(dynamixel_settings(unknown)), "model 4242, is not known here"));

    settings.pose_only = true;
    DynamixelDevice device(settings);
    std::string why;
    REQUIRE(device.open(why));
    CHECK(device.facts().capabilities.driven_dof == 0);
    BridgeSample sample;
    const Wrench push{Vec3(1, 0, 0), Vec3::Zero()};
    test::read_for(device, sample, 50, &push);
    CHECK(sample.calibrated);
    plain.with([](auto& b) {
      CHECK(b.goals.empty());
      CHECK(b.servo(1).table[64] == 0);
      CHECK(b.servo(1).table[11] == 3);
    });
  }

  TEST_CASE("the rate: six servos at 1 Mbaud, at 4 Mbaud, and a bus that is too slow") {
    DynamixelEmulator bus(6, kXc330);
    const auto period_at = [&](std::uint32_t baud) {
      DynamixelSettings settings = dynamixel_settings(bus);
      settings.arm.baud = baud;
      DynamixelDevice device(settings);
      std::string why;
      REQUIRE(device.open(why));
      return device.facts().capabilities.report_period_ns;
    };
    // 144 bytes and a frame of USB: 2.44 ms and 1.36 ms, each with a fifth to spare.
    CHECK(period_at(1'000'000) >= 3 * kMs);
    CHECK(period_at(4'000'000) >= 2 * kMs);
    bus.with([](auto& b) { b.delay_ms = 12; });
    const std::string why = refusal_of(dynamixel_settings(bus));
    CAPTURE(why);
    CHECK(has(why, "ms, which is too slow; raise the baud rate"));
  }
}
