// SPDX-License-Identifier: Apache-2.0
// A device of three degrees of freedom: twist and energy are those of a six degree one whose
// orientation stands still, bit for bit, for any reported turns.

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>

#include "rt_core/base/rotation.hpp"
#include "rt_core/base/twist_estimator.hpp"
#include "rt_core/safety/passivity.hpp"
#include "tests/support/random.hpp"

using namespace haptic;
using haptic::test::Random;

namespace {

constexpr std::uint64_t kTranslatingSeed = 0x3D0F;

Vec3 vector(Random& random, double size) {
  Vec3 v;
  for (int axis = 0; axis < 3; ++axis) v[axis] = static_cast<Real>(random.uniform(-size, size));
  return v;
}

}  // namespace

TEST_SUITE("rt_core.translating_device") {
  TEST_CASE("twist: that of an orientation that stands still") {
    const Quat still = Quat(0.6_r, -0.3_r, 0.2_r, 0.7_r).normalized();
    for (const double step_m : {0.0, 1.0e-4}) {
      TwistWindow window;
      window.step_m = static_cast<Real>(step_m);
      window.step_rad = 1.0e-3_r;
      TwistEstimator six(window), three(window);
      Random random(kTranslatingSeed);
      std::int64_t stamp_ns = 1'700'000'000'000'000'000;
      int valid = 0;
      for (int tick = 0; tick < 500; ++tick) {
        const double t = 1.0e-3 * tick;
        stamp_ns += static_cast<std::int64_t>(random.uniform(0.5e6, 3.0e6));
        TwistSample sample;
        sample.stamp_ns = stamp_ns;
        sample.grip_w =
            Vec3(static_cast<Real>(0.1 * std::sin(9.0 * t)), static_cast<Real>(0.2 * t), 0) +
            vector(random, step_m);
        sample.q_wa = still;
        const TwistEstimate want = six.update(sample);
        sample.q_wa = so3_exp(vector(random, 1.0));
        sample.sensed = tick % 7 == 3;
        sample.sensed_w.linear_w = vector(random, 1.0);
        sample.sensed_w.angular_w = vector(random, 1.0);
        const TwistEstimate got = three.update_place(sample);
        REQUIRE(got.sensed == sample.sensed);
        REQUIRE(got.twist_w.angular_w == Vec3::Zero());
        if (sample.sensed) {
          REQUIRE(got.twist_w.linear_w == sample.sensed_w.linear_w);
          continue;
        }
        REQUIRE(got.valid == want.valid);
        REQUIRE(got.twist_w.linear_w == want.twist_w.linear_w);
        REQUIRE(got.linear_window_s == want.linear_window_s);
        REQUIRE(want.twist_w.angular_w == Vec3::Zero());
        valid += got.valid ? 1 : 0;
      }
      CHECK(valid > 400);
    }
  }

  TEST_CASE("energy: no torque does work, and none is damped") {
    Random random(kTranslatingSeed);
    PassivityLimits limits;
    limits.mass_kg = 0.16_r;
    limits.damping_ns_per_m = 0.1_r;
    limits.rotor_kg_m2 = 1.0e-4_r;
    Passivity six(limits), three(limits);
    int acted = 0;
    for (int tick = 0; tick < 2000; ++tick) {
      PassivityInput in;
      in.stamp_ns = std::int64_t{tick} * 1'000'000;
      in.way_m = vector(random, 1.0e-3);
      in.twist_w.linear_w = vector(random, 0.5);
      in.twist_valid = true;
      in.command_w = {vector(random, 3.0), vector(random, 0.1)};
      const PassivityResult want = six.update(in);
      in.turn_rad = vector(random, 0.5);
      in.twist_w.angular_w = vector(random, 5.0);
      const PassivityResult got = three.update_place(in);
      REQUIRE(got.debt_j == want.debt_j);
      REQUIRE(got.wrench_w.force_w == want.wrench_w.force_w);
      REQUIRE(got.wrench_w.torque_w == in.command_w.torque_w);
      REQUIRE(got.acted == want.acted);
      acted += got.acted ? 1 : 0;
    }
    CHECK(acted > 100);
  }
}
