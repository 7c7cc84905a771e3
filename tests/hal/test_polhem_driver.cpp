// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "hal/drivers/polhem_driver.hpp"
#include "tests/hal/polhem_counterpart.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rt_guard.hpp"

using namespace haptic;
using namespace haptic::hal;
using haptic::test::PolhemCounterpart;
using haptic::test::Random;

namespace {

constexpr std::uint64_t kPolhemSeed = 60606;

PolhemSettings with_deadman() {
  PolhemSettings settings;
  settings.has_deadman = true;
  return settings;
}

ReportVerdict exchange(PolhemDriver& driver, PolhemCounterpart& device, const Vec3& force,
                       DeviceState& state, Wrench& delivered) {
  std::array<std::uint8_t, 64> bytes{};
  Wrench wrench;
  wrench.force_w = force;
  REQUIRE(driver.write(wrench, 1, bytes, delivered) == kPolhemReportBytes);
  device.on_out(std::span(bytes).first(kPolhemReportBytes));
  const std::size_t count = device.on_in(bytes);
  REQUIRE(count == kPolhemReportBytes);
  return driver.read(std::span(bytes).first(count), 0, state);
}

/// Presses the switch and exchanges until ready; the number of exchanges.
int calibrate(PolhemDriver& driver, PolhemCounterpart& device, DeviceState& state) {
  Wrench delivered;
  device.press_switch();
  int exchanges = 0;
  do {
    REQUIRE(exchange(driver, device, Vec3(1, 1, 1), state, delivered) == ReportVerdict::kState);
    // The first command leaves before the report that shows the switch.
    if (exchanges > 0) CHECK(delivered.force_w.isZero());
    ++exchanges;
  } while (state.link != LinkState::kReady && exchanges < 50);
  return exchanges;
}

}  // namespace

TEST_SUITE("hal.polhem_codec") {
  TEST_CASE("encode and decode: seven little-endian numbers, both ways, over random contents") {
    std::mt19937_64 random(kPolhemSeed);
    CAPTURE(kPolhemSeed);
    std::array<std::uint8_t, kPolhemReportBytes> bytes{};
    for (int i = 0; i < 50000; ++i) {
      PolhemReport report;
      for (std::int16_t& c : report.counts) c = static_cast<std::int16_t>(random());
      report.switch_pressed = (random() & 1u) != 0;
      encode(report, bytes);
      PolhemReport back;
      REQUIRE(decode(bytes, back) == PolhemVerdict::kOk);
      REQUIRE(back == report);
      PolhemCommand command;
      command.set_counts = (random() & 1u) != 0;
      if (command.set_counts) {
        command.counts = report.counts;
      } else {
        std::copy_n(report.counts.begin(), 3, command.currents_ma.begin());
      }
      encode(command, bytes);
      PolhemCommand again;
      REQUIRE(decode(bytes, again) == PolhemVerdict::kOk);
      REQUIRE(again == command);
    }
    PolhemCommand set;
    set.set_counts = true;
    set.counts = {1, 2, 3, 4, 5, -2};
    encode(set, bytes);
    CHECK(bytes == std::array<std::uint8_t, 14>{4, 0, 5, 0, 0xfe, 0xff, 1, 0, 1, 0, 2, 0, 3, 0});
  }

  TEST_CASE("decode: other lengths and unknown flags are refused, the result untouched") {
    for (std::size_t length = 0; length < 65; ++length) {
      PolhemReport report;
      PolhemCommand command;
      const PolhemVerdict expected = length == 14 ? PolhemVerdict::kOk : PolhemVerdict::kBadLength;
      CHECK(decode(std::vector<std::uint8_t>(length), report) == expected);
      CHECK(decode(std::vector<std::uint8_t>(length), command) == expected);
    }
    std::array<std::uint8_t, kPolhemReportBytes> bytes{};
    bytes[12] = 2;
    bytes[7] = 1;
    PolhemReport report;
    report.counts[0] = 9;
    PolhemCommand command;
    CHECK(decode(bytes, report) == PolhemVerdict::kBadNumber);
    CHECK(decode(bytes, command) == PolhemVerdict::kBadNumber);
    CHECK(report.counts[0] == 9);
  }
}

TEST_SUITE("hal.polhem_kinematics") {
  TEST_CASE("position_at: the arm straight up, straight out, and turned") {
    const PolhemGeometry g;
    const PolhemKinematics arm(g);
    const double quarter = std::acos(0.0);
    const auto near = [&arm](const PolhemAngles& angles, const Column3& p) {
      return (arm.position_at(angles) - p).norm() < 1e-12;
    };
    CHECK(near({0, 0, 2 * quarter, 0, 0, 0}, {0, 0, g.column_m + g.upper_arm_m + g.forearm_m}));
    CHECK(near({0, quarter, quarter, 0, 0, 0}, {g.upper_arm_m + g.forearm_m, 0, g.column_m}));
    CHECK(near({quarter, 0, quarter, 0, 0, 0}, {0, g.forearm_m, g.column_m + g.upper_arm_m}));
    // Forearm level, base turned: the handle's x axis points along the forearm.
    const auto q = arm.orientation_at({quarter, 0, quarter, 0, 0, 0});
    CHECK((q * Column3(1, 0, 0) - Column3(0, 1, 0)).norm() < 1e-12);
    const auto rolled = arm.orientation_at({0, 0, quarter, quarter, 0, 0});
    CHECK((rolled * Column3(0, 1, 0) - Column3(0, 0, 1)).norm() < 1e-12);
  }

  TEST_CASE("angles_of: capstan ratios, signs, and the wrist's channels in reverse") {
    const PolhemGeometry g;
    const PolhemKinematics arm(g);
    const PolhemAngles a = arm.angles_of({2000, 2000, -5000, 256, 512, 1024});
    const double turn = 4 * std::acos(0.0);
    CHECK(a[0] == doctest::Approx(-turn / 18));
    CHECK(a[1] == doctest::Approx(-turn / 10));
    CHECK(a[2] == doctest::Approx(turn / 4));  // the calibration pose: forearm level
    CHECK(a[3] == doctest::Approx(-turn));
    CHECK(a[4] == doctest::Approx(turn / 2));
    CHECK(a[5] == doctest::Approx(-turn / 4));
  }

  TEST_CASE("jacobian_at: equals finite differences; currents do the work of the force") {
    const PolhemGeometry g;
    const PolhemKinematics arm(g);
    Random random(kPolhemSeed);
    CAPTURE(kPolhemSeed);
    int regular = 0;
    for (int n = 0; n < 5000; ++n) {
      const PolhemAngles a{
          random.uniform(-1, 1), random.uniform(-0.5, 1), random.uniform(0.7, 2.4), 0, 0, 0};
      const Square3 jacobian = arm.jacobian_at(a);
      for (std::size_t k = 0; k < 3; ++k) {
        constexpr double kStep_rad = 1e-6;
        PolhemAngles before = a, behind = a;
        before[k] -= kStep_rad;
        behind[k] += kStep_rad;
        const Column3 slope = (arm.position_at(behind) - arm.position_at(before)) / (2 * kStep_rad);
        REQUIRE((jacobian.col(static_cast<Eigen::Index>(k)) - slope).norm() < 1e-9);
      }
      const Column3 force(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5));
      const Column3 currents = arm.currents_for(jacobian, force);
      const Column3 rates(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
      double motor_power = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto i = static_cast<Eigen::Index>(k);
        const double motor_rate = rates[i] * g.pulley_m[k] / g.capstan_m[k] * g.motor_sign[k];
        motor_power += currents[i] * g.torque_constant_nm_per_a[k] * motor_rate;
      }
      REQUIRE(motor_power == doctest::Approx(force.dot(jacobian * rates)).epsilon(1e-9).scale(1));
      Column3 unused = Column3::Zero();
      if (!solve3(jacobian, force, 0.02, unused)) continue;  // next to a singular posture
      ++regular;
      REQUIRE((arm.force_of(jacobian, currents) - force).norm() < 1e-5);
    }
    CHECK(regular > 4500);
  }

  TEST_CASE("force_of: in a singular posture finite, and without the part that the arm carries") {
    const PolhemKinematics arm;
    const double quarter = std::acos(0.0);
    // Stretched out level: a push along x finds no lever.
    const Square3 jacobian = arm.jacobian_at({0, quarter, quarter, 0, 0, 0});
    const Column3 currents = arm.currents_for(jacobian, {5, 2, 0});
    const Column3 force = arm.force_of(jacobian, currents);
    CHECK(haptic::hal::is_finite(force));
    CHECK(std::abs(force.x()) < 1e-3);
    CHECK(force.y() == doctest::Approx(2));
  }

  TEST_CASE("is_usable: refuses what no arm can be") {
    CHECK(is_usable(PolhemGeometry{}));
    PolhemGeometry g;
    g.forearm_m = 0;
    CHECK(!is_usable(g));
    g = {};
    g.wrist_channel = {3, 3, 5};
    CHECK(!is_usable(g));
    g = {};
    g.motor_sign[1] = 0.5;
    CHECK(!is_usable(g));
    g = {};
    g.torque_constant_nm_per_a[2] = std::nan("");
    CHECK(!is_usable(g));
  }
}

TEST_SUITE("hal.polhem_driver") {
  TEST_CASE("capabilities: usable, watchdog of half a second, opened on request only") {
    const DeviceCapabilities c = polhem_capabilities();
    CHECK(check_capabilities(c) == HalStatus::kOk);
    CHECK(c.watchdog_ns == 500'000'000);
    CHECK((c.q_wd * Vec3(1, 0, 0) - Vec3(0, -1, 0)).norm() < 1e-6);
    CHECK((c.q_wd * Vec3(0, 0, 1) - Vec3(0, 0, 1)).norm() < 1e-6);
    static_assert(PolhemDriver::kOnRequestOnly);
  }

  TEST_CASE("start: kicks the lock-step off with zero currents, or says that nothing answers") {
    PolhemDriver driver(with_deadman());
    PolhemCounterpart device;
    CHECK(driver.start(device) == HalStatus::kOk);
    CHECK(device.currents_ma() == std::array<std::int16_t, 3>{});
    PolhemCounterpart mute;
    mute.silent = true;
    CHECK(driver.start(mute) == HalStatus::kStartFailed);
    mute.gone = true;
    CHECK(driver.start(mute) == HalStatus::kDeviceGone);
    PolhemSettings settings;
    settings.geometry.column_m = -1;
    PolhemDriver unusable(settings);
    CHECK(unusable.start(device) == HalStatus::kBadCapabilities);
  }

  TEST_CASE("calibration: no force and no pose until the counts that were set have arrived") {
    PolhemDriver driver(with_deadman());
    PolhemCounterpart device;
    device.turn({123, -456, 789, 1, 2, 3});
    REQUIRE(driver.start(device) == HalStatus::kOk);
    DeviceState state;
    Wrench delivered;
    for (int i = 0; i < 20; ++i) {
      REQUIRE(exchange(driver, device, Vec3(5, 5, 5), state, delivered) == ReportVerdict::kState);
      CHECK(state.link == LinkState::kStarting);
      CHECK(delivered.force_w.isZero());
      CHECK(device.currents_ma() == std::array<std::int16_t, 3>{});
    }
    CHECK(calibrate(driver, device, state) == 2);  // seen, set
    CHECK(device.counts() == std::array<int, 6>{0, 0, -5000, 0, 0, 0});
    // Upright upper arm, level forearm: x is its length less the origin's.
    CHECK(state.pose_dh.p_m[0] == doctest::Approx(0.133 - 0.140));
    CHECK(state.pose_dh.p_m[2] == doctest::Approx(0.058 + 0.174 - 0.100));
    CHECK(state.pose_dh.q_xyzw[3] == doctest::Approx(1));
    REQUIRE(exchange(driver, device, Vec3(0, 1, 0), state, delivered) == ReportVerdict::kState);
    CHECK(delivered.force_w.y() == doctest::Approx(1).epsilon(0.01));
    CHECK(device.currents_ma()[0] != 0);

    // Pressed again: force ends at once, and comes back with the new counts.
    device.turn({400, 0, 0, 0, 0, 0});
    CHECK(calibrate(driver, device, state) == 2);
    CHECK(device.set_commands() == 2);
    // A new start forgets it all.
    REQUIRE(driver.start(device) == HalStatus::kOk);
    REQUIRE(exchange(driver, device, Vec3(0, 1, 0), state, delivered) == ReportVerdict::kState);
    CHECK(state.link == LinkState::kStarting);
    CHECK(delivered.force_w.isZero());
  }

  TEST_CASE("calibration: reports under way, lost commands and wrong counts") {
    PolhemDriver driver(with_deadman());
    DeviceState state;
    PolhemCounterpart late;
    late.turn({9000, 0, 0, 0, 0, 0});
    late.old_reports = 2;
    REQUIRE(driver.start(late) == HalStatus::kOk);
    CHECK(calibrate(driver, late, state) == 4);
    CHECK(late.set_commands() == 1);

    PolhemCounterpart lossy;
    lossy.lost_set_commands = 2;
    REQUIRE(driver.start(lossy) == HalStatus::kOk);
    CHECK(calibrate(driver, lossy, state) < 20);
    CHECK(lossy.set_commands() == 3);

    // Pressed where the counts are right already: still the command must arrive.
    PolhemCounterpart again;
    again.turn({0, 0, -5000, 0, 0, 0});
    again.lost_set_commands = 1;
    REQUIRE(driver.start(again) == HalStatus::kOk);
    CHECK(calibrate(driver, again, state) < 20);
    CHECK(again.set_commands() == 2);

    PolhemCounterpart wrong;
    wrong.sets_wrong_counts = true;
    REQUIRE(driver.start(wrong) == HalStatus::kOk);
    CHECK(calibrate(driver, wrong, state) == 50);  // never
    CHECK(state.link == LinkState::kStarting);
    CHECK(wrong.set_commands() == 1);  // only the operator can ask for more
  }

  TEST_CASE("without a deadman switch beside it: an input device, whose currents stay zero") {
    PolhemDriver driver;
    CHECK(driver.capabilities().sensed_dof == kDofAll);
    CHECK(driver.capabilities().driven_dof == 0u);
    CHECK(check_capabilities(driver.capabilities()) == HalStatus::kOk);
    PolhemCounterpart device;
    REQUIRE(driver.start(device) == HalStatus::kOk);
    DeviceState state;
    REQUIRE(calibrate(driver, device, state) < 10);
    Wrench delivered;
    REQUIRE(exchange(driver, device, Vec3(1, 2, 3), state, delivered) == ReportVerdict::kState);
    CHECK(state.link == LinkState::kReady);
    CHECK(delivered.force_w == Vec3::Zero());
    CHECK(device.currents_ma() == std::array<std::int16_t, 3>{});
    CHECK(PolhemDriver(with_deadman()).capabilities().driven_dof == kDofTranslation);
  }

  TEST_CASE("write: within the drives' current, direction kept, delivered as rounded") {
    const PolhemSettings settings = with_deadman();
    PolhemDriver driver(settings);
    PolhemCounterpart device;
    REQUIRE(driver.start(device) == HalStatus::kOk);
    DeviceState state;
    REQUIRE(calibrate(driver, device, state) < 10);
    Random random(kPolhemSeed);
    CAPTURE(kPolhemSeed);
    Wrench delivered;
    int cut = 0;
    for (int i = 0; i < 2000; ++i) {
      const double size = i % 3 == 0 ? 4.0 : i % 3 == 1 ? 12.0 : 400.0;
      const Vec3 force(static_cast<Real>(random.uniform(-size, size)),
                       static_cast<Real>(random.uniform(-size, size)),
                       static_cast<Real>(random.uniform(-size, size)));
      REQUIRE(exchange(driver, device, force, state, delivered) == ReportVerdict::kState);
      int largest = 0;
      for (const std::int16_t ma : device.currents_ma()) largest = std::max(largest, std::abs(ma));
      REQUIRE(largest <= 2000);
      if (largest >= 1999) {
        ++cut;
        REQUIRE(delivered.force_w.normalized().dot(force.normalized()) > 1 - 1e-5_r);
        REQUIRE(delivered.force_w.norm() < force.norm());
      } else {
        REQUIRE((delivered.force_w - force).norm() < 0.02_r);  // 1 mA is 5 mN at the forearm
      }
    }
    CHECK(cut > 500);
    device.pass(400'000'000);
    CHECK(device.drives_on());
    device.pass(100'000'000);
    CHECK(!device.drives_on());
  }

  TEST_CASE("read and write: hostile input") {
    PolhemDriver driver(with_deadman());
    PolhemCounterpart device;
    REQUIRE(driver.start(device) == HalStatus::kOk);
    DeviceState state;
    REQUIRE(calibrate(driver, device, state) < 10);
    Wrench delivered;
    const Real nan = std::numeric_limits<Real>::quiet_NaN();
    const Real inf = std::numeric_limits<Real>::infinity();
    for (const Vec3& force : {Vec3(nan, 0, 0), Vec3(0, inf, 0), Vec3(0, 0, -inf)}) {
      REQUIRE(exchange(driver, device, force, state, delivered) == ReportVerdict::kState);
      CHECK(delivered.force_w.isZero());
      CHECK(device.currents_ma() == std::array<std::int16_t, 3>{});
    }
    std::array<std::uint8_t, 13> small{};
    CHECK(driver.write(Wrench{}, 1, small, delivered) == 0);
    const DeviceState before = state;
    CHECK(driver.read(small, 0, state) == ReportVerdict::kBadLength);
    std::array<std::uint8_t, 14> odd{};
    odd[12] = 7;
    CHECK(driver.read(odd, 0, state) == ReportVerdict::kBadNumber);
    CHECK(state.pose_dh.p_m[0] == before.pose_dh.p_m[0]);
    CHECK(state.link == LinkState::kReady);
  }

  TEST_CASE("read and write: no heap calls") {
    PolhemDriver driver(with_deadman());
    PolhemCounterpart device;
    REQUIRE(driver.start(device) == HalStatus::kOk);
    DeviceState state;
    REQUIRE(calibrate(driver, device, state) < 10);
    std::array<std::uint8_t, kPolhemReportBytes> bytes{}, out{};
    encode(PolhemReport{{100, 200, -4000, 10, 20, 30}, false}, bytes);
    Wrench wrench, delivered;
    wrench.force_w = Vec3(1, 2, 3);
    std::uint64_t calls;
    {
      const haptic::test::RtGuard guard;
      static_cast<void>(driver.read(bytes, 0, state));
      static_cast<void>(driver.write(wrench, 1, out, delivered));
      calls = guard.heap_calls();
    }
    CHECK(calls == 0);
    CHECK(delivered.force_w.norm() > 1);
  }
}
