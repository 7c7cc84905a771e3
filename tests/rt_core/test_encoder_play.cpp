// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "rt_core/base/encoder_play.hpp"
#include "rt_core/base/rotation.hpp"
#include "tests/support/random.hpp"

using namespace haptic;

namespace {

constexpr std::uint64_t kPlaySeed = 0x91A7;
constexpr Real kStep_m = 1.0e-5_r, kStep_rad = 1.0e-3_r;

Vec3 random_vector(test::Random& random, double size) {
  Vec3 v;
  for (int axis = 0; axis < 3; ++axis) v[axis] = static_cast<Real>(random.uniform(-size, size));
  return v;
}

}  // namespace

TEST_SUITE("rt_core.encoder_play") {
  TEST_CASE("two counts: to and fro between neighbours moves nothing, a third count does") {
    EncoderPlay play(kStep_m, kStep_rad);
    (void)play.update(Vec3::Zero(), Quat::Identity());
    for (int tick = 0; tick < 20; ++tick) {
      const Real to = tick % 2 == 0 ? 1.0_r : -1.0_r;
      const PlayedPose p =
          play.update(Vec3(to * kStep_m, 0, 0), so3_exp(Vec3(0, 0.999_r * to * kStep_rad, 0)));
      REQUIRE(p.way_m == Vec3::Zero());
      REQUIRE(p.turn_rad == Vec3::Zero());
      REQUIRE(p.ahead_m.x() == to * kStep_m);
    }
    const PlayedPose p = play.update(Vec3(3 * kStep_m, 0, 0), so3_exp(Vec3(0, 3 * kStep_rad, 0)));
    CHECK(static_cast<double>(p.way_m.x()) == doctest::Approx(2.0 * static_cast<double>(kStep_m)));
    CHECK(static_cast<double>(p.turn_rad.y()) ==
          doctest::Approx(2.0 * static_cast<double>(kStep_rad)).epsilon(1e-3));
  }

  TEST_CASE("random way: never farther than a step off, and the ways add up") {
    CAPTURE(kPlaySeed);
    test::Random random(kPlaySeed);
    EncoderPlay play(kStep_m, kStep_rad);
    Vec3 grip = Vec3::Zero(), sum = Vec3::Zero();
    Quat q = Quat::Identity();
    (void)play.update(grip, q);
    for (int tick = 0; tick < 2000; ++tick) {
      grip += random_vector(random, 3.0e-5);
      q = (so3_exp(random_vector(random, 3.0e-3)) * q).normalized();
      const PlayedPose p = play.update(grip, q);
      sum += p.way_m;
      const Vec3 off = grip - p.grip_w, turned = so3_log(q * p.q_wa.conjugate());
      for (int axis = 0; axis < 3; ++axis) {
        REQUIRE(std::abs(off[axis]) <= 1.001_r * kStep_m);
        REQUIRE(std::abs(turned[axis]) <= 1.01_r * kStep_rad);
        REQUIRE(std::abs(sum[axis] - p.grip_w[axis]) <= 1.0e-3_r * kStep_m * 10);
      }
    }
  }

  TEST_CASE("no step: the sensed pose, bit by bit; poses that are none leave it where it is") {
    CAPTURE(kPlaySeed);
    test::Random random(kPlaySeed);
    EncoderPlay play(0, std::numeric_limits<Real>::quiet_NaN());
    for (int tick = 0; tick < 100; ++tick) {
      const Vec3 grip = random_vector(random, 1.0);
      const Quat q = so3_exp(random_vector(random, 1.0));
      const PlayedPose p = play.update(grip, q);
      REQUIRE(p.grip_w == grip);
      REQUIRE(p.q_wa.coeffs() == q.coeffs());
      const PlayedPose none =
          play.update(Vec3(std::numeric_limits<Real>::infinity(), 0, 0), Quat::Identity());
      REQUIRE(none.grip_w == grip);
      REQUIRE(none.way_m == Vec3::Zero());
    }
  }
}
