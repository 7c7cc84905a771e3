// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>

#include "hal/drivers/falcon_kinematics.hpp"
#include "tests/support/random.hpp"

using namespace haptic::hal;
using haptic::test::Random;

namespace {

constexpr std::uint64_t kFalconKinematicsSeed = 77001;
constexpr double kPi = 3.14159265358979323846;

/// Evenly inside the ball of 40 mm about the middle, except for the part beyond the legs: with
/// these lengths they are stretched 35 mm in front of the middle, and near that no angle is met
/// well.
Column3 point_in_workspace(Random& random) {
  const FalconKinematics arm;
  for (;;) {
    const Column3 p(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    if (p.norm() > 1.0) continue;
    const Column3 p_f = Column3(0, 0, kFalconCentre_m) + 0.040 * p;
    FalconAngles angles{};
    if (arm.angles_at(p_f + Column3(0, 0, 0.001), angles)) return p_f;
  }
}

struct LegPoint {
  double u, v, w;
};

LegPoint in_leg(const FalconGeometry& g, std::size_t i, const Column3& p) {
  const double phi = g.phi_deg[i] * kPi / 180.0;
  return {p.x() * std::cos(phi) + p.y() * std::sin(phi) - g.r_m,
          -p.x() * std::sin(phi) + p.y() * std::cos(phi) - g.s_m, p.z()};
}

}  // namespace

TEST_SUITE("hal.falcon_kinematics") {
  TEST_CASE("angles_at: the chain of links closes on the position, with the knee outside") {
    const FalconGeometry g;
    const FalconKinematics arm(g);
    Random random(kFalconKinematicsSeed);
    CAPTURE(kFalconKinematicsSeed);
    for (int n = 0; n < 20000; ++n) {
      const Column3 p = point_in_workspace(random);
      FalconAngles angles{};
      REQUIRE(arm.angles_at(p, angles));
      for (std::size_t i = 0; i < 3; ++i) {
        const LegPoint q = in_leg(g, i, p);
        // From the knee to the end of the shin in the leg's plane: the two links and what the
        // parallelogram does not lean out of it.
        const double du = q.u + g.c_m - g.a_m * std::cos(angles[i]);
        const double dw = q.w - g.a_m * std::sin(angles[i]);
        const double in_plane = std::hypot(du, dw) - g.d_m - g.e_m;
        const double leaning = q.v + g.f_m;
        REQUIRE(std::hypot(in_plane, leaning) == doctest::Approx(g.b_m).epsilon(1e-12));
        // The other solution of the same equation has a larger angle.
        const double middle = std::atan2(q.w, q.u + g.c_m);
        REQUIRE(angles[i] < middle);
      }
    }
  }

  TEST_CASE("angles_at: agrees with the half-angle form in which the sources write it") {
    // t = tan(t1 / 2) solves l2 t^2 + l1 t + l0 = 0; the smaller root is the arm's.
    const FalconGeometry g;
    const FalconKinematics arm(g);
    Random random(kFalconKinematicsSeed);
    for (int n = 0; n < 2000; ++n) {
      const Column3 p = point_in_workspace(random);
      FalconAngles angles{};
      REQUIRE(arm.angles_at(p, angles));
      for (std::size_t i = 0; i < 3; ++i) {
        const LegPoint q = in_leg(g, i, p);
        const double t3 = std::acos((q.v + g.f_m) / g.b_m);
        const double shin = g.d_m + g.e_m + g.b_m * std::sin(t3);
        const double common =
            q.w * q.w + q.u * q.u + 2 * g.c_m * q.u + g.a_m * g.a_m + g.c_m * g.c_m - shin * shin;
        const double l0 = common - 2 * g.a_m * q.u - 2 * g.a_m * g.c_m;
        const double l1 = -4 * g.a_m * q.w;
        const double l2 = common + 2 * g.a_m * q.u + 2 * g.a_m * g.c_m;
        const double t = (-l1 - std::sqrt(l1 * l1 - 4 * l0 * l2)) / (2 * l2);
        REQUIRE(angles[i] == doctest::Approx(2 * std::atan(t)).epsilon(1e-10));
      }
    }
  }

  TEST_CASE("angles_at: the legs reach 19 in 20 points of the workspace, all of them up to 30 mm") {
    const FalconKinematics arm;
    Random random(kFalconKinematicsSeed);
    CAPTURE(kFalconKinematicsSeed);
    int inside = 0, reached = 0;
    while (inside < 20000) {
      const Column3 p(random.uniform(-0.04, 0.04), random.uniform(-0.04, 0.04),
                      random.uniform(-0.04, 0.04));
      if (p.norm() > 0.04) continue;
      ++inside;
      FalconAngles angles{};
      const bool reaches = arm.angles_at(p + Column3(0, 0, kFalconCentre_m), angles);
      if (p.norm() <= 0.03) REQUIRE(reaches);
      reached += reaches ? 1 : 0;
    }
    MESSAGE("reached: ", reached, " of ", inside);
    CHECK(reached > inside * 94 / 100);
  }

  TEST_CASE("angles_at: legs that do not reach are refused, the result untouched") {
    const FalconKinematics arm;
    FalconAngles angles{1, 2, 3};
    for (const Column3& p : {Column3(0, 0, 0.4), Column3(0.3, 0, 0.15), Column3(0, -0.2, 0.15),
                             Column3(0, 0, std::nan(""))}) {
      CHECK(!arm.angles_at(p, angles));
      Square3 jacobian = Square3::Constant(7.0);
      CHECK(!arm.jacobian_at(p, jacobian));
      CHECK(jacobian(1, 2) == 7.0);
    }
    CHECK(angles == FalconAngles{1, 2, 3});
  }

  TEST_CASE("position_at: gives back the position of its angles to a nanometre, from anywhere") {
    const FalconKinematics arm;
    Random random(kFalconKinematicsSeed);
    CAPTURE(kFalconKinematicsSeed);
    double worst_m = 0.0;
    for (int n = 0; n < 20000; ++n) {
      const Column3 p = point_in_workspace(random);
      FalconAngles angles{};
      REQUIRE(arm.angles_at(p, angles));
      Column3 found = n % 2 == 0 ? Column3(0, 0, kFalconCentre_m) : point_in_workspace(random);
      REQUIRE(arm.position_at(angles, found));
      worst_m = std::max(worst_m, (found - p).norm());
    }
    MESSAGE("largest error of 20000 positions: ", worst_m, " m");
    CHECK(worst_m <= 1e-9);
  }

  TEST_CASE("position_at: angles of no position are refused, and the position stays") {
    const FalconKinematics arm;
    Random random(kFalconKinematicsSeed);
    CAPTURE(kFalconKinematicsSeed);
    const double rad = kPi / 180.0;
    for (const FalconAngles& angles :
         {FalconAngles{1000 * rad, 1000 * rad, 1000 * rad}, FalconAngles{-1159 * rad, 0, 0},
          FalconAngles{std::nan(""), 0.6, 0.6}, FalconAngles{0.8, 0.8, INFINITY},
          FalconAngles{-80 * rad, 100 * rad, -80 * rad}}) {
      Column3 p(0.001, 0.002, 0.151);
      CHECK(!arm.position_at(angles, p));
      CHECK(p == Column3(0.001, 0.002, 0.151));
    }
    Column3 nowhere(0, 0, std::nan(""));
    CHECK(!arm.position_at({0.8, 0.8, 0.8}, nowhere));
    // Any counts at all: either a position whose angles they are, or a refusal.
    int found = 0;
    for (int n = 0; n < 20000; ++n) {
      const FalconAngles angles{random.uniform(-1, 3), random.uniform(-1, 3),
                                random.uniform(-1, 3)};
      Column3 p(0, 0, kFalconCentre_m);
      if (!arm.position_at(angles, p)) continue;
      ++found;
      FalconAngles back{};
      REQUIRE(arm.angles_at(p, back));
      for (std::size_t i = 0; i < 3; ++i) {
        REQUIRE(std::abs(back[i] - angles[i]) <= FalconKinematics::kResidual_rad);
      }
    }
    CHECK(found > 100);
  }

  TEST_CASE("jacobian_at: equals finite differences of the inverse kinematics") {
    const FalconKinematics arm;
    Random random(kFalconKinematicsSeed);
    CAPTURE(kFalconKinematicsSeed);
    constexpr double kStep_m = 1e-6;
    for (int n = 0; n < 5000; ++n) {
      const Column3 p = point_in_workspace(random);
      Square3 jacobian;
      REQUIRE(arm.jacobian_at(p, jacobian));
      for (int axis = 0; axis < 3; ++axis) {
        Column3 step = Column3::Zero();
        step[axis] = kStep_m;
        FalconAngles before{}, behind{};
        REQUIRE(arm.angles_at(p - step, before));
        REQUIRE(arm.angles_at(p + step, behind));
        for (int leg = 0; leg < 3; ++leg) {
          const auto i = static_cast<std::size_t>(leg);
          const double difference = (behind[i] - before[i]) / (2 * kStep_m);
          REQUIRE(jacobian(leg, axis) == doctest::Approx(difference).epsilon(1e-5).scale(10));
        }
      }
    }
  }

  TEST_CASE("torques_for: power at the thighs is power at the handle, and force_of inverts it") {
    const FalconKinematics arm;
    Random random(kFalconKinematicsSeed);
    CAPTURE(kFalconKinematicsSeed);
    for (int n = 0; n < 5000; ++n) {
      const Column3 p = point_in_workspace(random);
      const Column3 force(random.uniform(-8, 8), random.uniform(-8, 8), random.uniform(-8, 8));
      const Column3 velocity(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
      Square3 jacobian;
      Column3 torques = Column3::Zero();
      REQUIRE(arm.jacobian_at(p, jacobian));
      REQUIRE(FalconKinematics::torques_for(jacobian, force, torques));
      const Column3 rates = jacobian * velocity;
      REQUIRE(torques.dot(rates) == doctest::Approx(force.dot(velocity)).epsilon(1e-10).scale(1));
      REQUIRE((FalconKinematics::force_of(jacobian, torques) - force).norm() < 1e-10);
    }
  }

  TEST_CASE("counts_of: the cable's ratio, and one count at the handle") {
    const FalconKinematics arm;
    const double step = arm.angles_of({1, 0, 0})[0] - arm.angles_of({0, 0, 0})[0];
    CHECK(step * 180.0 / kPi == doctest::Approx(0.036435).epsilon(1e-5));
    CHECK(arm.angles_of({0, 0, 0})[2] * 180.0 / kPi == doctest::Approx(35.0));
    CHECK(arm.counts_of(arm.angles_of({-1234, 567, 32767})) ==
          std::array<std::int16_t, 3>{-1234, 567, 32767});
    CHECK(arm.counts_of({100.0, -100.0, 0.6}) == std::array<std::int16_t, 3>{32767, -32768, -17});
    // The handle moves by at most 60 um per count over the workspace: the stated encoder step.
    Random random(kFalconKinematicsSeed);
    double worst_m = 0.0;
    for (int n = 0; n < 5000; ++n) {
      Square3 jacobian;
      REQUIRE(arm.jacobian_at(point_in_workspace(random), jacobian));
      for (int leg = 0; leg < 3; ++leg) {
        Column3 turn = Column3::Zero(), move = Column3::Zero();
        turn[leg] = step;
        REQUIRE(solve3(jacobian, turn, 1e-6, move));
        worst_m = std::max(worst_m, move.norm());
      }
    }
    MESSAGE("largest motion of one count: ", worst_m * 1e6, " um");
    CHECK(worst_m <= 60e-6);
  }
}
