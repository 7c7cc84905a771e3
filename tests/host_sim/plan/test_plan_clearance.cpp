// SPDX-License-Identifier: Apache-2.0
/// The room that a plan leaves is that of the surfaces, not that of its planes.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "host_sim/lab/planning/puzzles.hpp"
#include "host_sim/oracle/plan_clearance.hpp"
#include "tests/tools/plan/plan_bench.hpp"
#include "tools/plan/search/pose_algebra.hpp"

namespace haptic::sim {
namespace {

/// The scene's vertices are within 0.04 m of the origin: 2^-24 of it in single precision.
constexpr double kRounding_m = HAPTIC_REAL_IS_FLOAT ? 0.04 * 0x1p-24 : 1e-12;

/// A plan without planes: clearance_of looks at its poses alone.
tools::Plan bare_plan(std::initializer_list<tools::PlanPose> poses) {
  tools::Plan plan;
  plan.length_m = 0.03;
  plan.poses = poses;
  return plan;
}

tools::PlanPose upright(double x_m, double z_m, double turn_rad = 0) {
  return tools::plan_pose({x_m, 0, z_m}, tools::exp_of({0, 0, turn_rad}));
}

TEST_SUITE("host_sim.plan_clearance") {
  TEST_CASE("a peg led down the middle of its hole leaves the clearance of the hole") {
    for (const double clearance_mm : {1.0, 0.04, 0.01}) {
      const Puzzle puzzle = peg_puzzle(clearance_mm);
      const test::PlannedScene scene(puzzle.scene, puzzle.name);
      const auto room = [&](const tools::Plan& plan) { return clearance_of(scene.view, plan); };
      CAPTURE(clearance_mm);

      const PlanClearance middle = room(bare_plan({upright(0, 0.034), upright(0, -0.004)}));
      CHECK(middle.least_m == doctest::Approx(1e-3 * clearance_mm).epsilon(1e-9));
      CHECK(middle.poses >= 100);
      CHECK(middle.apart_m <= 0.038 / 99);

      // The probes: beside the middle by a quarter of the clearance, turned, and pressed on a wall.
      const double aside_m = 0.25e-3 * clearance_mm;
      CHECK(room(bare_plan({upright(aside_m, 0.034), upright(aside_m, -0.004)})).least_m ==
            doctest::Approx(3 * aside_m).epsilon(1e-9));
      const double turn = 0.01e-1 * clearance_mm;
      CHECK(room(bare_plan({upright(0, 0.034), upright(0, -0.002, turn)})).least_m ==
            doctest::Approx(0.01 + 1e-3 * clearance_mm - 0.01 * (std::cos(turn) + std::sin(turn)))
                .epsilon(1e-6));
      CHECK(room(bare_plan({upright(0, 0.034), upright(0, -0.005)})).least_m < kRounding_m);
    }
  }

  TEST_CASE("what is least on the way between two poses of a plan is seen") {
    // Over the edge of the hole at 2 mm, and from there far away and back.
    const Puzzle puzzle = peg_puzzle(1.0);
    const test::PlannedScene scene(puzzle.scene, puzzle.name);
    const PlanClearance found = clearance_of(
        scene.view, bare_plan({upright(-0.06, 0.06), upright(0.03, 0.032), upright(0.06, 0.06)}));
    CHECK(found.least_m == doctest::Approx(0.002).epsilon(1e-9));
    CHECK(found.at.x0_m[0] == doctest::Approx(0.03));
    const PlanClearance many = clearance_of(scene.view, [] {
      tools::Plan plan = bare_plan({});
      for (int k = 0; k <= 5000; ++k) plan.poses.push_back(upright(-0.05 + 2e-5 * k, 0.04));
      return plan;
    }());
    CHECK(many.poses <= 2002);
    CHECK(many.least_m == doctest::Approx(0.01).epsilon(1e-9));
  }
}

}  // namespace
}  // namespace haptic::sim
