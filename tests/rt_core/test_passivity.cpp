// SPDX-License-Identifier: Apache-2.0
// Observer and controller against their definition (rt_core/METHOD.md section 9.2).

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "rt_core/safety/passivity.hpp"
#include "tests/support/random.hpp"

using namespace haptic;

namespace {

constexpr std::uint64_t kPassivitySeed = 0xE4E6;
constexpr std::int64_t kTick_ns = 1'000'000;
/// Debt that may be rounding, of each joule stored: 10 000 roundings, 1.2 mJ in single precision.
constexpr double kRounding_j_per_j = 1.0e4 * static_cast<double>(kRealEpsilon);

struct PassivityRandom : test::Random {
  using test::Random::Random;
  Vec3 vector(double size) {
    Vec3 v;
    for (int axis = 0; axis < 3; ++axis) v[axis] = static_cast<Real>(uniform(-size, size));
    return v;
  }
};

PassivityLimits limits_of(double mass_kg, double damping, double rotor = 0,
                          double rotor_damping = 0, double noise_j = 0) {
  return {static_cast<Real>(mass_kg), static_cast<Real>(damping), static_cast<Real>(rotor),
          static_cast<Real>(rotor_damping), static_cast<Real>(noise_j)};
}

/// A wall of `k` along x; the hand walks to and fro through its surface, every way its own length.
struct Wall {
  double k = 1000, x = 0;
  PassivityInput in;

  void go(double to_m, bool stores) {
    in.stamp_ns += kTick_ns;
    in.way_m = Vec3(static_cast<Real>(to_m - x), 0, 0);
    in.twist_w.linear_w = in.way_m / 1.0e-3_r;
    in.twist_valid = true;
    x = to_m;
    const double deep = std::max(0.0, x);
    in.stores = stores;
    in.stored.linear_j = 0.5 * k * deep * deep;
    in.command_w.force_w = Vec3(static_cast<Real>(-k * deep), 0, 0);
  }
};

}  // namespace

TEST_SUITE("rt_core.passivity") {
  TEST_CASE("one interval by hand: what is generated, credited and paid") {
    // 2 N along 1 mm and 0.5 N m along 4 mrad done, 1 mJ less in the spring, in 2 ms; 0.25 N s/m
    // and 0.05 N m s/rad of the device take 0.125 mJ and 0.4 mJ of it.
    Passivity passivity(limits_of(1.0, 0.25, 0.02, 0.05));
    PassivityInput in;
    in.stores = true;
    in.stored = {2.0e-3, 1.0e-3};
    in.command_w = {Vec3(100, 0, 0), Vec3(0, 0, 10)};
    PassivityResult out = passivity.update(in);
    CHECK(out.debt_j == 0.0);
    CHECK_FALSE(out.acted);
    in.stamp_ns = 2 * kTick_ns;
    in.way_m = Vec3(1.0e-3_r, 0, 0);
    in.turn_rad = Vec3(0, 0, 4.0e-3_r);
    in.twist_valid = true;
    in.twist_w = {Vec3(0.5_r, 0, 0), Vec3(0, 0, 2)};
    in.stored = {1.5e-3, 0.5e-3};
    in.accepted_valid = true;
    in.accepted_w = {Vec3(2, 0, 0), Vec3(0, 0, 0.5_r)};
    out = passivity.update(in);
    const double debt = 4.0e-3 - 1.0e-3 - 0.25 * 1.0e-6 / 2.0e-3 - 0.05 * 16.0e-6 / 2.0e-3;
    CHECK(out.debt_j == doctest::Approx(debt).epsilon(1e-5));
    REQUIRE(out.acted);
    // Less than a quarter of twice the kinetic energy, 0.25 (1 0.25 + 0.02 4): all of it at once,
    // but for the rounding of the 5 mJ that the spring holds at both ends.
    const double ignored = kRounding_j_per_j * (3.0e-3 + 2.0e-3);
    const double part = (debt - ignored) / (0.25 * 0.33) * 0.25 / 2.0e-3;
    CHECK(static_cast<double>(out.alpha_ns_per_m) == doctest::Approx(part).epsilon(1e-4));
    CHECK(static_cast<double>(out.wrench_w.force_w.x()) ==
          doctest::Approx(100.0 - part * 0.5).epsilon(1e-4));
    CHECK(static_cast<double>(out.wrench_w.torque_w.z()) ==
          doctest::Approx(10.0 - part * 0.02 * 2.0).epsilon(1e-4));
    passivity.reset();
    CHECK(passivity.update(in).debt_j == 0.0);
  }

  TEST_CASE("a sampled spring: nothing within K T / 2 < b, with or without a potential") {
    CAPTURE(kPassivitySeed);
    for (const bool stores : {true, false}) {
      for (const double k : {100.0, 1000.0, 1999.0, 4000.0}) {
        PassivityRandom random(kPassivitySeed);
        Passivity passivity(limits_of(0.1, 1.0));
        Wall wall;
        wall.k = k;
        int acted = 0;
        for (int tick = 0; tick < 5000; ++tick) {
          wall.go(wall.x + random.uniform(-2.0e-4, 2.0e-4) - 0.01 * wall.x, stores);
          const PassivityResult out = passivity.update(wall.in);
          acted += out.acted ? 1 : 0;
          if (k < 2000.0) {
            REQUIRE(out.wrench_w.force_w == wall.in.command_w.force_w);
            REQUIRE(out.debt_j < 1.0e-9);
          }
        }
        CAPTURE(k);
        CHECK((acted > 100) == (k > 2000.0));
      }
    }
  }

  TEST_CASE("never a pull, nothing in free space, and the debt is kept for the next touch") {
    Passivity passivity(limits_of(0.1, 0.0));
    Wall wall;
    wall.k = 1.0e4;
    wall.go(-1.0e-3, true);
    (void)passivity.update(wall.in);
    wall.go(2.0e-3, true);  // touch: 20 mJ stored that nobody has paid
    PassivityResult out = passivity.update(wall.in);
    const double debt = out.debt_j;
    CHECK(debt == doctest::Approx(20.0e-3).epsilon(1e-3));
    CHECK(out.wrench_w.force_w.x() < wall.in.command_w.force_w.x());  // inwards it brakes
    wall.go(1.0e-5, true);  // outwards the damper would pull
    out = passivity.update(wall.in);
    // The damper of 25 N s/m takes 50 N off a pull of 0.1 N: less than a rounding of that is left.
    CHECK(out.wrench_w.force_w.x() <= (HAPTIC_REAL_IS_FLOAT ? 50 * kRealEpsilon : 1.0e-6_r));
    PassivityRandom random(kPassivitySeed);
    double before = 1.0;
    for (int tick = 0; tick < 1000; ++tick) {
      wall.go(random.uniform(-3.0e-3, -1.0e-3), true);
      wall.in.accepted_valid = true;
      wall.in.accepted_w = Wrench{};
      out = passivity.update(wall.in);
      REQUIRE(out.wrench_w.force_w == Vec3::Zero());
      REQUIRE_FALSE(out.acted);
      REQUIRE(out.debt_j < before);
      before = out.debt_j;
      if (tick == 0) CHECK(out.debt_j > 0.1 * debt);
    }
    wall.go(1.0e-4, true);
    out = passivity.update(wall.in);
    CHECK(out.acted);
    CHECK(wall.in.command_w.force_w.x() > out.wrench_w.force_w.x());
  }

  TEST_CASE("random wrenches: it takes energy out, and turns no force or torque round") {
    CAPTURE(kPassivitySeed);
    PassivityRandom random(kPassivitySeed);
    int acted = 0;
    for (int run = 0; run < 100; ++run) {
      Passivity passivity(limits_of(random.uniform(0.01, 1.0), 0.0, 1.0e-4, 0.0));
      PassivityInput in;
      in.accepted_valid = true;
      for (int tick = 0; tick < 100; ++tick) {
        in.stamp_ns += static_cast<std::int64_t>(random.uniform(1.0e5, 5.0e6));
        in.way_m = random.vector(1.0e-3);
        in.turn_rad = random.vector(1.0e-2);
        in.twist_valid = true;
        in.twist_w = {random.vector(0.5), random.vector(5.0)};
        in.accepted_w = {random.vector(5.0), random.vector(0.1)};
        in.command_w = {random.vector(5.0), random.vector(0.1)};
        const PassivityResult out = passivity.update(in);
        REQUIRE(out.wrench_w.force_w.dot(in.command_w.force_w) >= -1.0e-4_r);
        REQUIRE(out.wrench_w.torque_w.dot(in.command_w.torque_w) >= -1.0e-6_r);
        REQUIRE(out.debt_j >= 0.0);
        acted += out.acted ? 1 : 0;
        if (!out.acted) REQUIRE(out.wrench_w.force_w == in.command_w.force_w);
      }
    }
    CHECK(acted > 1000);
  }

  TEST_CASE("an amplifier's limit generates nothing: the spring counts in the share that acts") {
    // 5 N at most; the hand presses far beyond and comes back at 0.1 m/s.
    for (const bool clips : {true, false}) {
      Passivity passivity(limits_of(0.1, 1.0));
      Wall wall;
      double largest_j = 0;
      for (int tick = 0; tick < 400; ++tick) {
        const double before_n = wall.k * std::max(0.0, wall.x);
        wall.go(1.0e-4 * (tick < 200 ? tick : 400 - tick), true);
        wall.in.accepted_valid = true;
        wall.in.accepted_w.force_w =
            Vec3(static_cast<Real>(-std::min(clips ? 5.0 : 1e9, before_n)), 0, 0);
        largest_j = std::max(largest_j, passivity.update(wall.in).debt_j);
      }
      CAPTURE(clips);
      // What the first ticks at the limit leave; the spring holds 0.2 J, the work is 0.1 J. What
      // may be rounding of that spring, before and after a tick, is not paid.
      CHECK(largest_j < 2.0e-4 + kRounding_j_per_j * 0.4);
    }
  }

  TEST_CASE("encoder noise and a fading wrench make no debt that is paid") {
    Passivity passivity(limits_of(0.1, 0.0, 0, 0, 1.0e-3));
    Wall wall;
    wall.go(1.0e-3, true);
    (void)passivity.update(wall.in);
    wall.in.accepted_valid = true;
    wall.in.accepted_w = Wrench{};
    wall.go(1.5e-3, true);
    PassivityResult out = passivity.update(wall.in);
    CHECK(out.debt_j > 0.5e-3);
    CHECK_FALSE(out.acted);
    wall.in.accepted_w.force_w.x() = -1.0_r;
    wall.in.fading = true;
    wall.go(4.0e-3, true);
    out = passivity.update(wall.in);
    CHECK(out.debt_j < 1.0e-3);
    CHECK_FALSE(out.acted);
    wall.in.fading = false;
    wall.go(6.0e-3, true);  // the first tick after it has no interval of the law behind it
    CHECK_FALSE(passivity.update(wall.in).acted);
    wall.go(8.0e-3, true);
    CHECK(passivity.update(wall.in).acted);
  }

  TEST_CASE("energy that other parts give the spring is no debt, and what it gives them is one") {
    // A part that is pushed by 1 mm a tick into a spring whose hand stands still, and let go again.
    const auto largest_debt_j = [](double share) {
      Passivity passivity(limits_of(0.1, 1.0));
      PassivityInput in;
      in.stores = in.twist_valid = true;
      double before_j = 0, largest_j = 0;
      for (int k = 0; k <= 20; ++k) {
        const double stretch_m = 1e-3 * (k <= 10 ? k : 20 - k);
        in.stamp_ns += kTick_ns;
        in.stored.linear_j = 0.5 * 1000 * stretch_m * stretch_m;
        in.command_w.force_w = Vec3(static_cast<Real>(-1000 * stretch_m), 0, 0);
        in.given_j = share * (in.stored.linear_j - before_j);
        before_j = in.stored.linear_j;
        largest_j = std::max(largest_j, passivity.update(in).debt_j);
      }
      return largest_j;
    };
    CHECK(largest_debt_j(1) <= kRounding_j_per_j * 0.05);
    CHECK(largest_debt_j(0) == doctest::Approx(0.05));  // as if the rendering had made it
    CHECK(largest_debt_j(0.5) == doctest::Approx(0.025));
  }

  TEST_CASE("stamps that are not newer: counted, but neither credited nor paid") {
    Passivity passivity(limits_of(0.1, 1.0));
    PassivityInput in;
    in.accepted_valid = true;
    in.accepted_w.force_w.x() = 1.0_r;
    in.command_w.force_w.x() = 1.0_r;
    (void)passivity.update(in);
    in.way_m.x() = 1.0e-3_r;
    in.twist_valid = true;
    in.twist_w.linear_w.x() = 1.0_r;
    in.command_w.force_w.x() = 0.0_r;
    in.command_w.torque_w.x() = 1.0_r;
    const PassivityResult out = passivity.update(in);
    CHECK(out.debt_j == doctest::Approx(0.5e-3));  // half of what acted, the law's own being half
    CHECK_FALSE(out.acted);
  }

  TEST_CASE("hostile numbers never enter the account nor leave in the wrench") {
    CAPTURE(kPassivitySeed);
    PassivityRandom random(kPassivitySeed);
    constexpr Real kNotANumber = std::numeric_limits<Real>::quiet_NaN();
    const Real extremes[] = {kNotANumber,
                             std::numeric_limits<Real>::infinity(),
                             -std::numeric_limits<Real>::infinity(),
                             std::numeric_limits<Real>::max(),
                             std::numeric_limits<Real>::denorm_min(),
                             0.0_r};
    const auto strike = [&](Vec3& v) {
      if (random.uniform(0, 1) < 0.9) return;
      v[static_cast<int>(random.uniform(0, 2.999))] =
          extremes[static_cast<std::size_t>(random.uniform(0, 5.999))];
    };
    for (int run = 0; run < 200; ++run) {
      PassivityLimits limits = limits_of(0.1, 0.5, 1.0e-4, 1.0e-3);
      if (run % 4 == 1) limits.mass_kg = extremes[run / 4 % 6];
      if (run % 4 == 2) limits.damping_ns_per_m = extremes[run / 4 % 6];
      if (run % 4 == 3) limits.rotor_kg_m2 = extremes[run / 4 % 6];
      Passivity passivity(limits);
      for (int tick = 0; tick < 200; ++tick) {
        PassivityInput in;
        in.stamp_ns = static_cast<std::int64_t>(random.uniform(-9.0e18, 9.0e18));
        in.way_m = random.vector(1.0e-3);
        in.turn_rad = random.vector(1.0e-2);
        in.twist_w = {random.vector(0.1), random.vector(1.0)};
        in.twist_valid = tick % 2 == 0;
        in.stores = tick % 5 != 0;
        in.stored = {random.uniform(0, 0.1),
                     tick % 11 == 0 ? static_cast<double>(extremes[run % 6]) : 0.01};
        in.accepted_valid = tick % 3 != 0;
        in.accepted_w = {random.vector(10.0), random.vector(1.0)};
        in.command_w = {random.vector(10.0), random.vector(1.0)};
        for (Vec3* v : {&in.way_m, &in.turn_rad, &in.twist_w.linear_w, &in.twist_w.angular_w,
                        &in.accepted_w.force_w, &in.command_w.force_w, &in.command_w.torque_w}) {
          strike(*v);
        }
        const PassivityResult out = passivity.update(in);
        REQUIRE(is_finite(out.wrench_w));
        REQUIRE(std::isfinite(out.debt_j));
        REQUIRE(out.debt_j >= 0.0);
        REQUIRE(std::isfinite(out.alpha_ns_per_m));
      }
    }
  }
}
