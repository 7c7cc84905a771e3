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

  TEST_CASE("usable: no number, or looser than its range, becomes the default") {
    const SafetyLimits safe;
    for (const auto number : kNumbers) {
      for (const Real bad : {kNan, kInf, kHuge}) {
        SafetyLimits l;
        l.*number = bad;
        const SafetyLimits u = usable(l);
        for (const auto other : kNumbers) {
          if (other == &SafetyLimits::ramp_in_s && number == other) continue;  // the longest
          CHECK(u.*other == safe.*other);
        }
      }
    }
    SafetyLimits l;
    l.ramp_in_s = 0.001_r;   // shorter than a hand can answer
    l.decay_per_period = 1;  // would hold for ever
    l.max_axis_torque_nm = Vec3(kNan, -1, 0.01_r);
    l.driven_dof = ~0u;
    l.period_ns = -5;
    l.lost_periods = 100'000;
    const SafetyLimits u = usable(l);
    CHECK(u.ramp_in_s == safe.ramp_in_s);
    CHECK(u.decay_per_period < 1);
    CHECK(u.max_axis_torque_nm == Vec3(0, 0, 0.01_r));
    CHECK(u.driven_dof == 0x3fu);
    CHECK(u.period_ns == safe.period_ns);
    CHECK(u.lost_periods == safe.lost_periods);
  }

  TEST_CASE("usable: what is too tight becomes the tightest, never the default") {
    for (const auto number : kNumbers) {
      if (number == &SafetyLimits::ramp_in_s) continue;  // the longest is the tightest
      for (const Real tight : {0.0_r, -1.0_r, -kInf, -kHuge}) {
        SafetyLimits l;
        l.*number = tight;
        CHECK(usable(l).*number == 0.0_r);
      }
      SafetyLimits l;
      l.*number = 1.0e-12_r;
      CHECK(usable(l).*number == 1.0e-12_r);
    }
    SafetyLimits l;
    l.ramp_in_s = kHuge;
    CHECK(usable(l).ramp_in_s == 10.0_r);
    l.full_speed_m_per_s = 3;  // beyond the speed of no force: that one counts
    CHECK(usable(l).full_speed_m_per_s == l.zero_speed_m_per_s);
    l.held_periods = 9;
    l.lost_periods = 0;
    CHECK(usable(l).held_periods == 0u);
    CHECK(usable(l).lost_periods == 0u);
  }

  TEST_CASE("tighter: of each number the one that allows less, and the first one's period") {
    for (const auto number : kNumbers) {
      SafetyLimits a, b;
      b.*number = 0.5_r * a.*number;
      if (number == &SafetyLimits::ramp_in_s) b.*number = 2.0_r * a.*number;
      CHECK(tighter(a, b).*number == b.*number);
      CHECK(tighter(b, a).*number == b.*number);
      for (const auto other : kNumbers) {
        if (other != number) CHECK(tighter(a, b).*other == a.*other);
      }
    }
    SafetyLimits a, b;
    a.max_axis_force_n = Vec3(2, 0, 0);
    b.max_axis_force_n = Vec3(3, 1, 0);
    a.driven_dof = 0x3e;
    b.driven_dof = 0x0f;
    a.held_periods = 0;
    b.lost_periods = 3;
    b.period_ns = 500'000;
    const SafetyLimits both = tighter(a, b);
    CHECK(both.max_axis_force_n == Vec3(2, 1, 0));
    CHECK(both.driven_dof == 0x0eu);
    CHECK(both.held_periods == 0u);
    CHECK(both.lost_periods == 3u);
    CHECK(both.period_ns == a.period_ns);
    b.max_force_n = kNan;  // says nothing, and loosens nothing
    CHECK(tighter(a, b).max_force_n == a.max_force_n);
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
    l.slew_n_per_s = 0;  // no force at all
    l.slew_nm_per_s = kNan;
    CHECK(static_cast<double>(longest_ramp_s(l)) == doctest::Approx(5.0e-3));
    l.max_torque_nm = 0;
    CHECK(longest_ramp_s(l) == 0.0_r);
  }
}
