// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>

#include "rt_core/safety/safety_limits.hpp"
#include "rt_core/safety/wrench_ramp.hpp"

using namespace haptic;

namespace {

constexpr Real kNan = std::numeric_limits<Real>::quiet_NaN();
constexpr Real kInf = std::numeric_limits<Real>::infinity();
constexpr Real kHuge = std::numeric_limits<Real>::max();

constexpr Real SafetyLimits::*kNumbers[] = {
    &SafetyLimits::max_force_n,         &SafetyLimits::max_torque_nm,
    &SafetyLimits::slew_n_per_s,        &SafetyLimits::slew_nm_per_s,
    &SafetyLimits::ramp_in_s,           &SafetyLimits::full_speed_m_per_s,
    &SafetyLimits::zero_speed_m_per_s,  &SafetyLimits::full_turn_rad_per_s,
    &SafetyLimits::zero_turn_rad_per_s, &SafetyLimits::decay_per_period,
    &SafetyLimits::jump_speed_m_per_s,  &SafetyLimits::jump_turn_rad_per_s};

}  // namespace

TEST_SUITE("rt_core.safety_limits") {
  TEST_CASE("usable: the defaults are, and limits that are stay as they are") {
    SafetyLimits l;
    l.max_force_n = 0;  // a device without force
    l.max_torque_nm = 0.2_r;
    l.max_axis_force_n = Vec3(1, 0, 2);
    l.slew_n_per_s = 90;
    l.ramp_in_s = kMinRampIn_s;
    l.driven_dof = 7;
    l.full_speed_m_per_s = 0.3_r;
    l.zero_speed_m_per_s = 0.4_r;
    l.period_ns = 250'000;
    l.held_periods = 0;
    l.lost_periods = 0;
    l.decay_per_period = 0;
    for (const SafetyLimits& given : {SafetyLimits{}, l}) {
      const SafetyLimits u = usable(given);
      for (const auto number : kNumbers) CHECK(u.*number == given.*number);
      CHECK(u.max_axis_force_n == given.max_axis_force_n);
      CHECK(u.driven_dof == given.driven_dof);
      CHECK(u.period_ns == given.period_ns);
      CHECK(u.held_periods == given.held_periods);
      CHECK(u.lost_periods == given.lost_periods);
    }
  }

  TEST_CASE("usable: a number that is none, or out of its range, becomes the default") {
    const SafetyLimits safe;
    for (const auto number : kNumbers) {
      for (const Real bad : {kNan, kInf, -kInf, kHuge, -1.0_r}) {
        SafetyLimits l;
        l.*number = bad;
        const SafetyLimits u = usable(l);
        for (const auto other : kNumbers) CHECK(u.*other == safe.*other);
      }
    }
    SafetyLimits l;
    l.slew_n_per_s = 0;      // "no limit" is no answer
    l.ramp_in_s = 0.001_r;   // shorter than a hand can answer
    l.decay_per_period = 1;  // would hold for ever
    l.full_speed_m_per_s = 3;
    l.max_axis_torque_nm = Vec3(kNan, -1, 0.01_r);
    l.driven_dof = ~0u;
    l.period_ns = -5;
    l.held_periods = 9;
    const SafetyLimits u = usable(l);
    CHECK(u.slew_n_per_s == safe.slew_n_per_s);
    CHECK(u.ramp_in_s == safe.ramp_in_s);
    CHECK(u.decay_per_period == safe.decay_per_period);
    CHECK(u.full_speed_m_per_s == safe.full_speed_m_per_s);
    CHECK(u.max_axis_torque_nm == Vec3(0, 0, 0.01_r));
    CHECK(u.driven_dof == 0x3fu);
    CHECK(u.period_ns == safe.period_ns);
    CHECK(u.held_periods == safe.held_periods);
    CHECK(u.lost_periods == safe.lost_periods);
  }

  TEST_CASE("longest ramp: of force or torque, whichever takes longer") {
    SafetyLimits l;
    l.max_force_n = 3;
    l.slew_n_per_s = 600;
    l.max_torque_nm = 0.05_r;
    l.slew_nm_per_s = 10;
    CHECK(static_cast<double>(longest_ramp_s(l)) == doctest::Approx(5.0e-3));
    l.slew_nm_per_s = 1;
    CHECK(static_cast<double>(longest_ramp_s(l)) == doctest::Approx(50.0e-3));
    l.slew_n_per_s = 0;
    l.slew_nm_per_s = kNan;
    CHECK(static_cast<double>(longest_ramp_s(l)) == doctest::Approx(5.0e-3));
  }
}
