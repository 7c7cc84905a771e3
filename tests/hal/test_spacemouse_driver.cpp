// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "hal/drivers/spacemouse_driver.hpp"
#include "tests/support/rt_guard.hpp"
#include "tests/support/spacemouse_counterpart.hpp"

using namespace haptic;
using namespace haptic::hal;
using haptic::test::SpaceMouseCounterpart;

namespace {

constexpr std::uint64_t kSpacemouseSeed = 31337;
constexpr std::int64_t kReport_ns = 8'000'000;

SpaceMouseSettings settings_for(std::uint16_t vendor, std::uint16_t product) {
  SpaceMouseSettings s;
  s.vendor_id = vendor;
  s.product_id = product;
  s.dead_zone = 0;
  return s;
}

/// Feeds everything that the device has; the number of states.
int drain(SpaceMouseDriver& driver, SpaceMouseCounterpart& device, std::int64_t stamp_ns,
          DeviceState& state) {
  std::array<std::uint8_t, 64> bytes{};
  int states = 0;
  for (int i = 0; i < 100; ++i) {
    const std::size_t count = device.on_in(bytes);
    if (count == 0) break;
    const ReportVerdict verdict = driver.read(std::span(bytes).first(count), stamp_ns, state);
    REQUIRE((verdict == ReportVerdict::kState || verdict == ReportVerdict::kNothing));
    states += verdict == ReportVerdict::kState ? 1 : 0;
  }
  return states;
}

}  // namespace

TEST_SUITE("hal.spacemouse_driver") {
  TEST_CASE("models: no identity twice, none of them refused") {
    std::set<std::pair<int, int>> seen;
    for (const SpaceMouseModel& model : spacemouse_models()) {
      CHECK(seen.insert({model.vendor_id, model.product_id}).second);
      CHECK(!is_refused_spacemouse(model.vendor_id, model.product_id));
      CHECK(find_spacemouse(model.vendor_id, model.product_id) == &model);
    }
    CHECK(seen.size() == 21);
    CHECK(find_spacemouse(0x256f, 0xc650) == nullptr);
  }

  TEST_CASE("start: refused and foreign identities are not used, unknown ones of the maker are") {
    SpaceMouseCounterpart device(true);
    for (const int product : {0xc62c, 0xc641, 0xc650, 0xc651, 0xc654, 0xc655, 0xc656, 0xc657,
                              0xc658, 0xc664, 0xc665, 0xc668}) {
      SpaceMouseDriver driver(settings_for(0x256f, static_cast<std::uint16_t>(product)));
      CHECK(driver.start(device) == HalStatus::kDeviceUnfit);
    }
    CHECK(SpaceMouseDriver(settings_for(0x046d, 0xc077)).start(device) == HalStatus::kDeviceUnfit);
    CHECK(device.light() == -1);  // not one request reached it
    CHECK(SpaceMouseDriver(settings_for(0x256f, 0xc6ff)).start(device) == HalStatus::kOk);
    CHECK(device.light() == 1);
  }

  TEST_CASE("capabilities: six sensed, none driven, rates; nothing is ever sent") {
    SpaceMouseDriver driver;
    const DeviceCapabilities& c = driver.capabilities();
    CHECK(check_capabilities(c) == HalStatus::kOk);
    CHECK(c.sensed_dof == kDofAll);
    CHECK(c.driven_dof == 0);
    std::array<std::uint8_t, 64> bytes{};
    Wrench wrench, delivered;
    wrench.force_w = delivered.force_w = Vec3(1, 2, 3);
    CHECK(driver.write(wrench, 1, bytes, delivered) == 0);
    CHECK(delivered.force_w.isZero());
  }

  TEST_CASE("start: full scale by descriptor, by setting, or the stated one when neither says") {
    SpaceMouseCounterpart device(false, 512);
    SpaceMouseDriver driver(settings_for(0x046d, 0xc626));
    CHECK(driver.start(device) == HalStatus::kOk);
    for (std::size_t i = 0; i < 6; ++i) CHECK(driver.full_scale_of(i) == 512.0);

    SpaceMouseSettings stated = settings_for(0x046d, 0xc626);
    stated.full_scale = 400;
    SpaceMouseDriver by_setting(stated);
    CHECK(by_setting.start(device) == HalStatus::kOk);
    CHECK(by_setting.full_scale_of(5) == 400.0);

    const std::vector<std::uint8_t> whole = device.descriptor;
    device.descriptor.clear();  // the request stalls
    CHECK(driver.start(device) == HalStatus::kOk);
    CHECK(driver.full_scale_of(0) == kDisplacementFullScale);
    device.descriptor.assign(whole.begin(), whole.begin() + 40);  // cut behind X, Y, Z
    device.takes_light = false;
    CHECK(driver.start(device) == HalStatus::kOk);
    CHECK(driver.full_scale_of(0) == 512.0);
    CHECK(driver.full_scale_of(5) == kDisplacementFullScale);
    device.gone = true;
    CHECK(driver.start(device) == HalStatus::kDeviceGone);
  }

  TEST_CASE("read: a full push for a second goes one second's way, joined or split alike") {
    for (const bool joined : {false, true}) {
      SpaceMouseCounterpart device(joined);
      SpaceMouseSettings settings = settings_for(0x256f, 0xc635);
      settings.full_speed_m_per_s = 0.1_r;
      settings.full_turn_rad_per_s = 0.5_r;
      SpaceMouseDriver driver(settings);
      REQUIRE(driver.start(device) == HalStatus::kOk);
      DeviceState state;
      std::int64_t now_ns = 1'000'000'000;
      for (int i = 0; i <= 125; ++i, now_ns += kReport_ns) {
        device.push({350, 0, 0, 0, 0, -350});
        CHECK(drain(driver, device, now_ns, state) == (joined ? 1 : 2));
      }
      CHECK(state.link == LinkState::kReady);
      CHECK(state.twist_valid);
      CHECK(state.twist_d.linear_m_per_s[0] == doctest::Approx(0.1));
      CHECK(state.twist_d.angular_rad_per_s[2] == doctest::Approx(0.5));  // raw z points down
      CHECK(state.pose_dh.p_m[0] == doctest::Approx(0.1).epsilon(1e-5));
      CHECK(state.pose_dh.q_xyzw[2] == doctest::Approx(std::sin(0.25)).epsilon(1e-5));
      // Let go, a second later pushed again: the pose has not moved in between.
      device.push({0, 0, 0, 0, 0, 0});
      drain(driver, device, now_ns, state);
      const Real rest_x = state.pose_dh.p_m[0];
      device.push({-350, 0, 0, 0, 0, 0});
      drain(driver, device, now_ns + 1'000'000'000, state);
      CHECK(state.pose_dh.p_m[0] == doctest::Approx(rest_x));
    }
  }

  TEST_CASE("read: axes of current and older models become right, away, up") {
    struct Case {
      std::uint16_t vendor, product;
      std::array<std::int16_t, 6> raw;
      Vec3 push, turn;
    };
    // Current: right, towards, down. Older: right, up, away.
    for (const Case& c : {Case{0x256f, 0xc635, {350, 350, 350, 0, 350, 0}, {1, -1, -1}, {0, -1, 0}},
                          Case{0x046d, 0xc606, {0, 350, 0, 0, 0, 350}, {0, 0, 1}, {0, 1, 0}}}) {
      SpaceMouseCounterpart device(true);
      SpaceMouseSettings settings = settings_for(c.vendor, c.product);
      settings.full_speed_m_per_s = settings.full_turn_rad_per_s = 1;
      SpaceMouseDriver driver(settings);
      REQUIRE(driver.start(device) == HalStatus::kOk);
      DeviceState state;
      device.push(c.raw);
      drain(driver, device, 0, state);
      CHECK((twist_of(state.twist_d).linear_w - c.push).norm() < 1e-6);
      CHECK((twist_of(state.twist_d).angular_w - c.turn).norm() < 1e-6);
    }
  }

  TEST_CASE("read: inside the dead zone rest, at its edge no jump, at full scale full speed") {
    SpaceMouseSettings settings = settings_for(0x256f, 0xc635);
    settings.dead_zone = 0.1_r;
    settings.full_speed_m_per_s = 1;
    SpaceMouseDriver driver(settings);
    SpaceMouseCounterpart device(true, 1000);
    REQUIRE(driver.start(device) == HalStatus::kOk);
    const auto speed_at = [&](std::int16_t raw) {
      DeviceState state;
      device.push({raw, 0, 0, 0, 0, 0});
      drain(driver, device, 0, state);
      return state.twist_d.linear_m_per_s[0];
    };
    CHECK(speed_at(100) == 0);
    CHECK(speed_at(-100) == 0);
    CHECK(speed_at(109) == doctest::Approx(0.01));
    CHECK(speed_at(-550) == doctest::Approx(-0.5));
    CHECK(speed_at(1000) == doctest::Approx(1));
    CHECK(speed_at(32767) == 1);  // beyond what the descriptor says: cut
    CHECK(speed_at(-32768) == -1);
  }

  TEST_CASE("read: time going backward or far ahead, and endless pushing, keep the pose bounded") {
    SpaceMouseSettings settings = settings_for(0x256f, 0xc635);
    settings.full_speed_m_per_s = 1;
    SpaceMouseDriver driver(settings);
    SpaceMouseCounterpart device(true);
    REQUIRE(driver.start(device) == HalStatus::kOk);
    DeviceState state;
    device.push({350, 0, 0, 0, 0, 0});
    drain(driver, device, 1'000, state);
    device.push({350, 0, 0, 0, 0, 0});
    drain(driver, device, std::numeric_limits<std::int64_t>::max(), state);
    CHECK(state.pose_dh.p_m[0] == doctest::Approx(0.05));  // 50 ms at most
    device.push({350, 0, 0, 0, 0, 0});
    drain(driver, device, std::numeric_limits<std::int64_t>::min(), state);
    CHECK(state.pose_dh.p_m[0] == doctest::Approx(0.05));

    SpaceMouseDriver other(settings);
    REQUIRE(other.start(device) == HalStatus::kOk);
    std::mt19937_64 random(kSpacemouseSeed);
    CAPTURE(kSpacemouseSeed);
    for (int i = 0; i < 20000; ++i) {
      device.push({350, static_cast<std::int16_t>(random()), 350, 350,
                   static_cast<std::int16_t>(random()), 350});
      drain(other, device, i * kReport_ns, state);
    }
    CHECK(vec3_of(state.pose_dh.p_m).norm() == doctest::Approx(0.25).epsilon(1e-3));
    CHECK(pose_of(state.pose_dh).q_wa.norm() == doctest::Approx(1).epsilon(1e-6));
  }

  TEST_CASE("read: buttons, battery, unknown numbers and short reports") {
    SpaceMouseDriver driver(settings_for(0x256f, 0xc633));
    SpaceMouseCounterpart device(true);
    REQUIRE(driver.start(device) == HalStatus::kOk);
    DeviceState state;
    device.press(0x80000005u);
    CHECK(drain(driver, device, 0, state) == 1);
    CHECK(state.switches == 0x80000005u);
    device.say_battery(87);
    CHECK(drain(driver, device, 0, state) == 0);
    CHECK(driver.input().battery_percent == 87);
    const std::vector<std::vector<std::uint8_t>> unknown{{0}, {4, 1}, {28, 1, 2}, {255}};
    for (const auto& report : unknown)
      CHECK(driver.read(report, 0, state) == ReportVerdict::kNothing);
    const std::vector<std::vector<std::uint8_t>> cut{
        {}, {1}, {1, 0, 0, 0, 0, 0}, {2, 0, 0, 0, 0, 0}, {3}, {23}};
    for (const auto& report : cut)
      CHECK(driver.read(report, 0, state) == ReportVerdict::kBadLength);
    CHECK(state.switches == 0x80000005u);
  }

  TEST_CASE("read: where the descriptor splits the axes, filling behind three is no turn") {
    SpaceMouseDriver driver(settings_for(0x046d, 0xc626));
    SpaceMouseCounterpart device(false);
    REQUIRE(driver.start(device) == HalStatus::kOk);
    DeviceState state;
    const std::vector<std::uint8_t> filled{1, 0x5e, 1, 0, 0, 0, 0, 0x5e, 1, 0x5e, 1, 0x5e, 1, 0, 0};
    CHECK(driver.read(filled, 0, state) == ReportVerdict::kState);
    CHECK(state.twist_d.linear_m_per_s[0] == doctest::Approx(0.1));
    CHECK(vec3_of(state.twist_d.angular_rad_per_s).norm() == 0);
  }

  TEST_CASE("rest: a velocity goes on for its time alone, and silence is a hand at rest") {
    SpaceMouseSettings settings;
    settings.full_speed_m_per_s = 0.1_r;
    settings.longest_step_ns = 50'000'000;
    SpaceMouseDriver silent(settings), told(settings);
    SpaceMouseCounterpart device(true), other(true);
    REQUIRE(silent.start(device) == HalStatus::kOk);
    REQUIRE(told.start(other) == HalStatus::kOk);
    DeviceState state, expected;
    // From the first moment on, before any report.
    REQUIRE(silent.rest(1'000'000, state));
    CHECK(state.link == LinkState::kReady);
    CHECK(state.pose_dh.p_m[0] == 0.0_r);
    std::array<std::uint8_t, 64> bytes{};
    const auto report = [&bytes](SpaceMouseCounterpart& from, SpaceMouseDriver& driver,
                                 std::int64_t stamp_ns, DeviceState& to) {
      const std::size_t size = from.on_in(bytes);
      REQUIRE(driver.read(std::span(bytes).first(size), stamp_ns, to) == ReportVerdict::kState);
    };
    device.push({350, 0, 0, 0, 0, 0});
    other.push({350, 0, 0, 0, 0, 0});
    report(device, silent, 2'000'000, state);
    report(other, told, 2'000'000, expected);
    for (int ms = 3; ms <= 18; ++ms) REQUIRE(silent.rest(ms * 1'000'000, state));
    CHECK(state.pose_dh.p_m[0] == doctest::Approx(0.0016));
    CHECK(state.twist_d.linear_m_per_s[0] == doctest::Approx(0.1));
    // In between or not: the next report finds the same pose.
    device.push({350, 0, 0, 0, 0, 0});
    other.push({350, 0, 0, 0, 0, 0});
    report(device, silent, 18'000'000, state);
    report(other, told, 18'000'000, expected);
    CHECK(state.pose_dh.p_m[0] == doctest::Approx(expected.pose_dh.p_m[0]));
    // The cap came back and said so no more: at rest once a velocity can have lasted no longer.
    for (int ms = 19; ms <= 1000; ++ms) {
      REQUIRE(silent.rest(ms * 1'000'000, state));
      if (ms < 68) continue;
      CHECK(state.twist_d.linear_m_per_s[0] == 0.0_r);
      CHECK(state.pose_dh.p_m[0] == doctest::Approx(0.0016 + 0.005));
    }
    device.push({0, 0, 0, 0, 0, 0});
    report(device, silent, 1'001'000'000, state);
    CHECK(state.pose_dh.p_m[0] == doctest::Approx(0.0016 + 0.005));
  }

  TEST_CASE("read: buttons say nothing of the axes, and bring no velocity back") {
    SpaceMouseDriver driver(settings_for(0x256f, 0xc635));
    SpaceMouseCounterpart device(true);
    REQUIRE(driver.start(device) == HalStatus::kOk);
    DeviceState state;
    device.push({350, 0, 0, 0, 0, 0});
    drain(driver, device, 0, state);
    device.press(1);
    drain(driver, device, 20'000'000, state);
    CHECK(state.pose_dh.p_m[0] == doctest::Approx(0.002));
    CHECK(state.twist_d.linear_m_per_s[0] == doctest::Approx(0.1));
    device.press(0);  // 50 ms after the axes' report, which no other has followed
    drain(driver, device, 60'000'000, state);
    CHECK(state.pose_dh.p_m[0] == doctest::Approx(0.005));
    CHECK(state.twist_d.linear_m_per_s[0] == 0.0_r);
    device.press(1);
    drain(driver, device, 70'000'000, state);
    CHECK(state.pose_dh.p_m[0] == doctest::Approx(0.005));
    CHECK(state.twist_d.linear_m_per_s[0] == 0.0_r);
  }

  TEST_CASE("read: no heap calls") {
    SpaceMouseDriver driver;
    SpaceMouseCounterpart device(true);
    REQUIRE(driver.start(device) == HalStatus::kOk);
    const auto report = encode_long(std::array<std::int16_t, 6>{1, 2, 3, 300, -300, 200});
    DeviceState state;
    std::uint64_t calls;
    {
      const haptic::test::RtGuard guard;
      for (int i = 0; i < 10; ++i) static_cast<void>(driver.read(report, i * kReport_ns, state));
      calls = guard.heap_calls();
    }
    CHECK(calls == 0);
    CHECK(state.link == LinkState::kReady);
  }
}
