// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <limits>
#include <random>

#include "hal/device_limits.hpp"
#include "hal/drivers/reference_driver.hpp"

using namespace haptic;
using namespace haptic::hal;

TEST_SUITE("hal.device_limits") {
  TEST_CASE("limits_of: the reference device keeps its own force, torque and rates") {
    const SafetyLimits limits = limits_of(reference_capabilities(), 500'000);
    CHECK(static_cast<double>(limits.max_force_n) == doctest::Approx(12.0));
    CHECK(static_cast<double>(limits.max_torque_nm) == doctest::Approx(0.3));
    CHECK(static_cast<double>(limits.slew_n_per_s) == doctest::Approx(2000.0));
    CHECK(static_cast<double>(limits.slew_nm_per_s) == doctest::Approx(40.0));
    CHECK(limits.driven_dof == kDofAll);
    CHECK(limits.period_ns == 500'000);
  }

  TEST_CASE("limits_of: nothing known, the defaults; no watchdog, half of the force") {
    const SafetyLimits defaults;
    DeviceCapabilities c;
    SafetyLimits limits = limits_of(c, 0);
    CHECK(limits.max_force_n == kShareWithoutWatchdog * defaults.max_force_n);
    CHECK(limits.max_torque_nm == kShareWithoutWatchdog * defaults.max_torque_nm);
    CHECK(limits.slew_n_per_s == defaults.slew_n_per_s);
    CHECK(limits.slew_nm_per_s == defaults.slew_nm_per_s);
    CHECK(limits.period_ns == defaults.period_ns);
    CHECK(limits.driven_dof == 0);
    c.max_force_n = 8;
    c.max_axis_force_n = Vec3(6, 0, 4);
    limits = limits_of(c, -1);
    CHECK(limits.max_force_n == 4);
    CHECK(limits.max_axis_force_n == Vec3(3, 0, 2));
    c.watchdog_ns = 1'000'000'000;
    CHECK(limits_of(c, 1).max_axis_force_n == Vec3(6, 0, 4));
  }

  TEST_CASE("limits_of: numbers that are none do not pass") {
    const SafetyLimits defaults;
    for (const Real bad :
         {std::numeric_limits<Real>::quiet_NaN(), std::numeric_limits<Real>::infinity(), -5.0_r}) {
      DeviceCapabilities c = reference_capabilities();
      c.max_force_n = c.max_torque_nm = c.max_force_rate_n_per_s = c.max_torque_rate_nm_per_s = bad;
      c.max_axis_force_n = Vec3(bad, 1, 1);
      const SafetyLimits limits = limits_of(c, 1'000'000);
      CHECK(limits.max_force_n == defaults.max_force_n);
      CHECK(limits.max_torque_nm == defaults.max_torque_nm);
      CHECK(limits.slew_n_per_s == defaults.slew_n_per_s);
      CHECK(limits.max_axis_force_n.x() == 0);
    }
  }

  TEST_CASE("limits_of: a ramp ends within half the watchdog, by the device's own rate") {
    constexpr std::uint64_t kSeed = 4711;
    INFO("seed " << kSeed);
    std::mt19937_64 engine(kSeed);
    const auto up_to = [&](double most) {
      return static_cast<Real>(most * static_cast<double>(engine() >> 11) * 0x1.0p-53);
    };
    for (int i = 0; i < 20'000; ++i) {
      DeviceCapabilities c;
      c.max_force_n = up_to(40);
      c.max_torque_nm = up_to(1);
      if (i % 2 == 0) c.max_force_rate_n_per_s = up_to(4000);
      if (i % 3 == 0) c.max_torque_rate_nm_per_s = up_to(100);
      c.watchdog_ns = 1'000'000 + static_cast<std::int64_t>(engine() % 100'000'000);
      const SafetyLimits limits = limits_of(c, 1'000'000);
      const Real half_s = static_cast<Real>(c.watchdog_ns) * 0.5e-9_r * (1 + 8 * kRealEpsilon);
      CHECK(limits.max_force_n <= limits.slew_n_per_s * half_s);
      CHECK(limits.max_torque_nm <= limits.slew_nm_per_s * half_s);
      CHECK(limits.max_force_n <= c.max_force_n);
      CHECK(limits.max_torque_nm <= c.max_torque_nm);
      if (i % 2 == 0) CHECK(limits.slew_n_per_s == c.max_force_rate_n_per_s);
      if (i % 3 == 0) CHECK(limits.slew_nm_per_s == c.max_torque_rate_nm_per_s);
    }
  }

  TEST_CASE("limits_of_connection: the tighter of each, and a ramp within half the watchdog") {
    const SafetyLimits own = limits_of(reference_capabilities(), 1'000'000);
    DeviceCapabilities c = reference_capabilities();
    CHECK(limits_of_connection(own, c).max_force_n == own.max_force_n);
    c.max_force_n = 1;
    c.max_force_rate_n_per_s = 50;
    c.driven_dof = kDofTranslation;
    SafetyLimits limits = limits_of_connection(own, c);
    CHECK(static_cast<double>(limits.max_force_n) == doctest::Approx(0.5));
    CHECK(static_cast<double>(limits.slew_n_per_s) == doctest::Approx(50.0));
    CHECK(limits.max_torque_nm == own.max_torque_nm);
    CHECK(limits.driven_dof == kDofTranslation);
    // What the file has lowered stays lowered, and its slew lowers the force by the same rule.
    SafetyLimits lowered = own;
    lowered.slew_n_per_s = 20;
    lowered.max_torque_nm = 0.01_r;
    limits = limits_of_connection(lowered, reference_capabilities());
    CHECK(static_cast<double>(limits.slew_n_per_s) == doctest::Approx(20.0));
    CHECK(static_cast<double>(limits.max_force_n) == doctest::Approx(0.2));
    CHECK(limits.max_torque_nm == lowered.max_torque_nm);
    // A machine that is late gets its share of what the device states, too, where that is less.
    SafetyLimits half = own;
    half.max_force_n *= 0.5_r;
    half.max_torque_nm *= 0.5_r;
    DeviceCapabilities weak = reference_capabilities();
    weak.max_force_n = 2;
    weak.max_torque_nm = 0.02_r;
    limits = limits_of_connection(half, weak, 0.5_r);
    CHECK(static_cast<double>(limits.max_force_n) == doctest::Approx(1.0));
    CHECK(static_cast<double>(limits.max_torque_nm) == doctest::Approx(0.01));
    CHECK(limits.slew_n_per_s == limits_of_connection(half, weak).slew_n_per_s);
    // Of any watchdog, or none, the ramp is over before the device is closed.
    for (const std::int64_t watchdog_ns : {std::int64_t{0}, std::int64_t{1'000'000'000}}) {
      DeviceCapabilities slow = reference_capabilities();
      slow.watchdog_ns = watchdog_ns;
      lowered = own;
      lowered.slew_n_per_s = 5;
      lowered.slew_nm_per_s = 0.1_r;
      limits = limits_of_connection(lowered, slow);
      CHECK(static_cast<double>(limits.max_force_n) == doctest::Approx(1.25));
      CHECK(static_cast<double>(limits.max_torque_nm) == doctest::Approx(0.025));
      CHECK(longest_ramp_s(limits) <= kLongestRamp_s * (1 + 8 * kRealEpsilon));
    }
    // A device that says nothing is not given what a bold configuration wants.
    DeviceCapabilities silent;
    silent.driven_dof = kDofAll;
    limits = limits_of_connection(own, silent);
    CHECK(limits.max_force_n == kShareWithoutWatchdog * SafetyLimits{}.max_force_n);
    const LimitsRecord record = limits_record(limits, c, 7);
    CHECK(record.connection == 7u);
    CHECK(record.max_force_n == limits.max_force_n);
    CHECK(record.slew_nm_per_s == limits.slew_nm_per_s);
    CHECK(record.driven_dof == limits.driven_dof);
    CHECK(record.report_period_ns == c.report_period_ns);
  }
}
