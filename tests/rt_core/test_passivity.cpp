// SPDX-License-Identifier: Apache-2.0
// The observer against work summed by other means, the controller against its definition
// (rt_core/METHOD.md section 9).

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "rt_core/base/rotation.hpp"
#include "rt_core/safety/passivity.hpp"
#include "tests/support/random.hpp"

using namespace haptic;

namespace {

constexpr std::uint64_t kSeed = 0xE4E6;
constexpr double kEpsilon = static_cast<double>(kRealEpsilon);
const Real kNotANumber = std::numeric_limits<Real>::quiet_NaN();

struct Random : test::Random {
  using test::Random::Random;
  Vec3 vector(double size) {
    Vec3 v;
    for (int axis = 0; axis < 3; ++axis) v[axis] = static_cast<Real>(uniform(-size, size));
    return v;
  }
};

double dot(const Vec3& l, const Vec3& r) { return l.cast<double>().dot(r.cast<double>()); }

PassivityLimits limits_of(double l_m, double alpha_max, double cap_j) {
  return {static_cast<Real>(l_m), static_cast<Real>(alpha_max), static_cast<Real>(cap_j)};
}

}  // namespace

TEST_SUITE("rt_core.passivity") {
  TEST_CASE("one interval by hand: energy, cap, and the wrench that pays within an interval") {
    Passivity passivity(limits_of(0.1, 25.0, 0.5));
    PassivityInput in;
    in.command_w = {Vec3(1, 0, 0), Vec3(0, 0, 0.25_r)};
    PassivityResult out = passivity.update(in);
    CHECK(out.energy_j == 0.0);
    CHECK_FALSE(out.acted);
    CHECK(out.wrench_w.force_w == in.command_w.force_w);
    // 2 N along 1 mm and 0.5 N m along 4 mrad: 4 mJ given out in 2 ms.
    in.stamp_ns = 2'000'000;
    in.grip_w = Vec3(1.0e-3_r, 0, 0);
    in.q_wa = so3_exp(Vec3(0, 0, 4.0e-3_r));
    in.accepted_valid = true;
    in.accepted_w = {Vec3(2, 0, 0), Vec3(0, 0, 0.5_r)};
    out = passivity.update(in);
    CHECK(out.energy_j == doctest::Approx(-4.0e-3).epsilon(1e-5));
    // v = 0.5 m/s, w = 2 rad/s: 2 ms (0.25 + 0.01 4) alpha = 4 mJ.
    CHECK(out.acted);
    const double alpha = 4.0e-3 / (2.0e-3 * 0.29);
    CHECK(static_cast<double>(out.alpha_ns_per_m) == doctest::Approx(alpha).epsilon(1e-4));
    CHECK(static_cast<double>(out.wrench_w.force_w.x()) ==
          doctest::Approx(1.0 - alpha * 0.5).epsilon(1e-4));
    CHECK(static_cast<double>(out.wrench_w.torque_w.z()) ==
          doctest::Approx(0.25 - alpha * 0.01 * 2.0).epsilon(1e-4));
    // Going on the same way against that damper alone settles the debt exactly.
    in.accepted_w = {out.wrench_w.force_w - in.command_w.force_w,
                     out.wrench_w.torque_w - in.command_w.torque_w};
    in.stamp_ns = 4'000'000;
    in.grip_w = Vec3(2.0e-3_r, 0, 0);
    in.q_wa = so3_exp(Vec3(0, 0, 8.0e-3_r));
    out = passivity.update(in);
    CHECK(std::abs(out.energy_j) <= 4.0e-3 * 1.0e-3);
    // The hand puts in 2 J: credited up to the cap.
    in.accepted_w = {Vec3(-1000, 0, 0), Vec3::Zero()};
    in.stamp_ns = 6'000'000;
    in.grip_w = Vec3(4.0e-3_r, 0, 0);
    out = passivity.update(in);
    CHECK(out.energy_j == doctest::Approx(0.5));
    CHECK(passivity.energy_j() == out.energy_j);
    CHECK_FALSE(out.acted);
    passivity.reset();
    CHECK(passivity.energy_j() == 0.0);
    in.grip_w = Vec3(1, 1, 1);  // no interval behind it
    CHECK(passivity.update(in).energy_j == 0.0);
  }

  TEST_CASE("observer: the sum of F.dx + tau.dphi over random motion, regardless of the stamps") {
    CAPTURE(kSeed);
    Random random(kSeed);
    for (int run = 0; run < 20; ++run) {
      const double cap_j = run % 2 == 0 ? 1.0e6 : 0.05;
      Passivity passivity(limits_of(0.05, 0.0, cap_j));
      PassivityInput in;
      in.accepted_valid = true;
      (void)passivity.update(in);
      double expected_j = 0, scale_j = 0;
      for (int tick = 0; tick < 500; ++tick) {
        in.stamp_ns += static_cast<std::int64_t>(random.uniform(-2.0e6, 5.0e6));
        const Vec3 dphi = random.vector(0.1);
        const Vec3 before = in.grip_w;
        in.grip_w += random.vector(5.0e-3);
        in.q_wa = so3_exp(dphi) * in.q_wa;  // R_k R_{k-1}^T = exp(dphi), W axes
        if (tick % 3 == 0) in.q_wa.coeffs() *= -1.0_r;
        in.accepted_w = {random.vector(10.0), random.vector(0.5)};
        in.command_w = {random.vector(10.0), random.vector(0.5)};
        const Vec3 dx = in.grip_w - before;
        const double work_j = dot(in.accepted_w.force_w, dx) + dot(in.accepted_w.torque_w, dphi);
        expected_j = std::min(expected_j - work_j, cap_j);
        scale_j += 1.0;
        const PassivityResult out = passivity.update(in);
        REQUIRE(std::abs(out.energy_j - expected_j) <= 8.0 * kEpsilon * scale_j);
        REQUIRE_FALSE(out.acted);  // alpha_max 0
        REQUIRE(out.wrench_w.force_w == in.command_w.force_w);
      }
    }
  }

  TEST_CASE("controller: takes out, never puts in, no more than the debt, no more than alpha_max") {
    CAPTURE(kSeed);
    Random random(kSeed);
    int acted = 0, full = 0;
    for (int run = 0; run < 100; ++run) {
      const double l_m = random.uniform(0.0, 0.2);
      const double alpha_max = std::exp2(random.uniform(-6.0, 8.0));
      Passivity passivity(limits_of(l_m, alpha_max, 0.01));
      PassivityInput in;
      in.accepted_valid = true;
      Vec3 dphi = Vec3::Zero();
      for (int tick = 0; tick < 100; ++tick) {
        const double span_s = std::exp2(random.uniform(-13.0, -6.0));
        in.stamp_ns += static_cast<std::int64_t>(span_s * 1.0e9);
        const Vec3 dx = random.vector(1.0e-3);
        in.grip_w = dx;  // from the origin each time: dx free of rounding
        dphi = random.vector(1.0e-2);
        in.q_wa = so3_exp(dphi);
        in.accepted_w = {random.vector(5.0), random.vector(0.1)};
        in.command_w = {random.vector(5.0), random.vector(0.1)};
        in.twist_valid = true;
        in.twist_w = {random.vector(0.5), random.vector(5.0)};
        const PassivityResult out = passivity.update(in);
        const Vec3 df = out.wrench_w.force_w - in.command_w.force_w;
        const Vec3 dt = out.wrench_w.torque_w - in.command_w.torque_w;
        const double power_w = dot(df, in.twist_w.linear_w) + dot(dt, in.twist_w.angular_w);
        const double rounding_w = 60.0 * kEpsilon;
        REQUIRE(power_w <= rounding_w);
        REQUIRE(out.acted == (out.energy_j < 0.0 && tick > 0));
        REQUIRE(static_cast<double>(out.alpha_ns_per_m) <= alpha_max * (1.0 + kEpsilon));
        if (!out.acted) {
          REQUIRE(df == Vec3::Zero());
          REQUIRE(dt == Vec3::Zero());
          continue;
        }
        REQUIRE(-power_w * span_s <= -out.energy_j * (1.0 + 1.0e-4) + rounding_w);
        const bool at_most = static_cast<double>(out.alpha_ns_per_m) >= alpha_max * (1 - kEpsilon);
        if (!at_most) {
          REQUIRE(-power_w * span_s ==
                  doctest::Approx(-out.energy_j).epsilon(1e-3).scale(rounding_w * 10.0));
        }
        ++acted;
        full += at_most ? 1 : 0;
      }
    }
    CHECK(acted > 1000);
    CHECK(full > 100);
    CHECK(acted - full > 100);
  }

  TEST_CASE("no accepted wrench: the layer's own last output, damper included") {
    Passivity passivity(limits_of(0.0, 10.0, 0.0));
    PassivityInput in;
    in.command_w.force_w = Vec3(2, 0, 0);
    (void)passivity.update(in);
    in.stamp_ns = 1'000'000;
    in.grip_w.x() = 1.0e-3_r;
    PassivityResult out = passivity.update(in);
    CHECK(out.energy_j == doctest::Approx(-2.0e-3).epsilon(1e-5));
    CHECK(static_cast<double>(out.wrench_w.force_w.x()) ==
          doctest::Approx(0.0).scale(1.0).epsilon(1e-4));  // alpha 2, v 1 m/s
    const double held_n = static_cast<double>(out.wrench_w.force_w.x());
    in.stamp_ns = 2'000'000;
    in.grip_w.x() = 3.0e-3_r;
    out = passivity.update(in);
    CHECK(out.energy_j == doctest::Approx(-2.0e-3 - held_n * 2.0e-3).epsilon(1e-4));
  }

  TEST_CASE("stamps: equal and backward ones use the last interval's time, far ones their own") {
    Passivity passivity(limits_of(0.0, 1.0e6, 0.0));
    PassivityInput in;
    in.accepted_valid = true;
    in.accepted_w.force_w.x() = 1.0_r;
    (void)passivity.update(in);
    in.grip_w.x() = 1.0e-3_r;
    PassivityResult out = passivity.update(in);  // no time known yet
    CHECK(out.energy_j == doctest::Approx(-1.0e-3).epsilon(1e-5));
    CHECK_FALSE(out.acted);
    in.stamp_ns = 2'000'000;
    in.grip_w.x() = 3.0e-3_r;
    out = passivity.update(in);  // -3 mJ at 1 m/s over 2 ms: alpha 1.5
    CHECK(static_cast<double>(out.alpha_ns_per_m) == doctest::Approx(1.5).epsilon(1e-4));
    out = passivity.update(in);  // the same report again
    CHECK(out.energy_j == doctest::Approx(-3.0e-3).epsilon(1e-5));
    CHECK(static_cast<double>(out.alpha_ns_per_m) == doctest::Approx(1.5).epsilon(1e-4));
    in.stamp_ns = 1'000'000;
    in.grip_w.x() = 2.0e-3_r;  // an older report: its way back counts
    out = passivity.update(in);
    CHECK(out.energy_j == doctest::Approx(-2.0e-3).epsilon(1e-5));
    CHECK(static_cast<double>(out.alpha_ns_per_m) == doctest::Approx(1.0).epsilon(1e-4));
    in.stamp_ns = std::numeric_limits<std::int64_t>::max();
    in.grip_w.x() = 4.0e-3_r;
    out = passivity.update(in);
    CHECK(out.energy_j == doctest::Approx(-4.0e-3).epsilon(1e-5));
    CHECK(is_finite(out.wrench_w));
    CHECK(static_cast<double>(out.alpha_ns_per_m) <= 1.0e6);
    // At rest there is nothing to damp, regardless of the debt.
    in.stamp_ns = 5;
    (void)passivity.update(in);
    in.stamp_ns = 1'000'005;
    out = passivity.update(in);
    CHECK_FALSE(out.acted);
    CHECK(out.wrench_w.force_w == Vec3::Zero());
  }

  TEST_CASE("hostile numbers never enter the balance nor leave in the wrench") {
    CAPTURE(kSeed);
    Random random(kSeed);
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
      PassivityLimits limits = limits_of(0.1, 25.0, 1.0e-3);
      if (run % 4 == 1) limits.l_m = extremes[run / 4 % 6];
      if (run % 4 == 2) limits.alpha_max_ns_per_m = extremes[run / 4 % 6];
      if (run % 4 == 3) limits.energy_cap_j = extremes[run / 4 % 6];
      Passivity passivity(limits);
      for (int tick = 0; tick < 200; ++tick) {
        PassivityInput in;
        in.stamp_ns = static_cast<std::int64_t>(random.uniform(-9.0e18, 9.0e18));
        in.grip_w = random.vector(1.0);
        strike(in.grip_w);
        in.q_wa = so3_exp(random.vector(3.0));
        if (random.uniform(0, 1) > 0.95) in.q_wa.coeffs() *= extremes[tick % 6];
        in.twist_valid = tick % 2 == 0;
        strike(in.twist_w.linear_w);
        strike(in.twist_w.angular_w);
        in.accepted_valid = tick % 3 != 0;
        in.accepted_w = {random.vector(10.0), random.vector(1.0)};
        strike(in.accepted_w.force_w);
        in.command_w = {random.vector(10.0), random.vector(1.0)};
        strike(in.command_w.force_w);
        strike(in.command_w.torque_w);
        const PassivityResult out = passivity.update(in);
        REQUIRE(is_finite(out.wrench_w));
        REQUIRE(std::isfinite(out.energy_j));
        REQUIRE(std::isfinite(out.alpha_ns_per_m));
        REQUIRE(out.alpha_ns_per_m >= 0.0_r);
      }
    }
    // A pose that is none is skipped: the way is counted whole with the next.
    Passivity passivity(limits_of(0.0, 0.0, 1.0));
    PassivityInput in;
    in.accepted_valid = true;
    in.accepted_w.force_w.x() = -1.0_r;
    (void)passivity.update(in);
    in.stamp_ns = 1'000'000;
    in.grip_w.x() = kNotANumber;
    CHECK(passivity.update(in).energy_j == 0.0);
    in.stamp_ns = 2'000'000;
    in.grip_w.x() = 0.25_r;
    CHECK(passivity.update(in).energy_j == doctest::Approx(0.25));
  }
}
