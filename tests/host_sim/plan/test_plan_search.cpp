// SPDX-License-Identifier: Apache-2.0
// Plans through tight and twisting places; what they must turn, slide and enter for is in the
// names.
#include <doctest/doctest.h>

#include <string>
#include <utility>

#include "host_sim/plan/puzzles.hpp"
#include "tests/host_sim/plan/plan_bench.hpp"
#include "tools/plan/plan_check.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

void check_plan(const SceneView& view, const MadePlan& found) {
  REQUIRE(found.search.found);
  const tools::PlanProof proof = tools::prove_plan(view, found.plan, "p");
  CHECK(proof.failure == "");
  CHECK(proof.certified == proof.steps);
  CHECK(found.plan.stations.size() <= tools::kMostPlanStations);
}

void check_puzzle(const Puzzle& puzzle) {
  CAPTURE(puzzle.name);
  const PlannedScene scene(puzzle.scene, puzzle.name);
  check_plan(scene.view, plan_to(scene.view, puzzle.goal));
}

}  // namespace

TEST_SUITE("host_sim.plan") {
  TEST_CASE("plan: scenes of the gallery") {
    for (const auto& [folder, goal] : {std::pair{"square_peg_five", "0,0,-39mm,1,0,0,0"},
                                       {"ell_insert", "0,0,-19.9mm,1,0,0,0"},
                                       {"dovetail", "0,0,0.1mm,1,0,0,0"},
                                       {"two_pins", "0,0,0.1mm,1,0,0,0"},
                                       {"gear_on_shaft", "0,0,-24.9mm,1,0,0,0"}}) {
      CAPTURE(folder);
      const PlannedScene scene{std::string(folder)};
      check_plan(scene.view, plan_to(scene.view, goal));
    }
  }

  TEST_CASE("plan: a slider over its rail goes round to the end of the groove") {
    const PlannedScene scene("dovetail");
    check_plan(scene.view, plan_to(scene.view, "0,0,0.1mm,1,0,0,0", 1, 60, "0,0,40mm,1,0,0,0"));
  }

  TEST_CASE("plan: a peg with clearances from 2 mm to 10 um") {
    for (const double clearance_mm : {2.0, 0.5, 0.1, 0.05, 0.02, 0.01}) {
      check_puzzle(peg_puzzle(clearance_mm));
    }
  }

  TEST_CASE("plan: a bar turns in contact with three walls round a corner") {
    for (const double long_mm : {50.0, 64.0, 68.0}) {
      check_puzzle(corner_puzzle(long_mm));
    }
  }

  TEST_CASE("plan: an L goes through a window, one arm after the other") {
    for (const double wide_mm : {44.0, 24.0, 20.0}) {
      check_puzzle(window_puzzle(wide_mm));
    }
  }

  TEST_CASE("plan: a bar goes through a slot and turns behind it") {
    check_puzzle(slot_puzzle(0.2));
  }

  TEST_CASE("plan: from a closed box there is none, and the search says how far it got") {
    const PlannedScene scene(cage_puzzle().scene, "cage");
    SlidingPart part(scene.view);
    StepProver prover(scene.view, 1e-7);
    SearchLimits limits;
    limits.most_nodes = 300;
    const SearchResult result = search_plan(scene.view, part, prover, part.grip_pose(Pose{}),
                                            plan_pose(Vec3d(0, 0, 0.06), Quatd::Identity()), limits,
                                            [](const SearchState&) {});
    CHECK_FALSE(result.found);
    CHECK(place_of(result.nearest_to_goal).cwiseAbs().maxCoeff() < 0.0011);
    CHECK(result.state.nearest_m > 0.02);
  }

  TEST_CASE("plan: the same seed gives the same bytes, another seed another proved plan") {
    const Puzzle puzzle = window_puzzle(20);
    const std::string& goal = puzzle.goal;
    const PlannedScene scene(puzzle.scene, puzzle.name);
    const MadePlan one = plan_to(scene.view, goal, 7), same = plan_to(scene.view, goal, 7),
                   other = plan_to(scene.view, goal, 8);
    check_plan(scene.view, one);
    check_plan(scene.view, other);
    CHECK(tools::plan_as_text(one.plan) == tools::plan_as_text(same.plan));
    CHECK(tools::plan_as_text(one.plan) != tools::plan_as_text(other.plan));
  }

  TEST_CASE("step prover: a step through a thin wall is not proved, one past it is") {
    const PlannedScene scene(window_puzzle(44).scene, "window");
    StepProver prover(scene.view, 1e-7);
    ProvedMotion motion;
    const PlanPose before = plan_pose(Vec3d(0, 0, 0.1), Quatd::Identity());
    const PlanPose behind = plan_pose(Vec3d(0.1, 0, 0.1), Quatd::Identity());
    const PlanPose aside = plan_pose(Vec3d(-0.05, 0, 0.1), Quatd::Identity());
    CHECK(prover.prove(before, aside, 8, ProofSearch::kAny, motion));
    CHECK(motion.poses.size() == motion.steps.size());
    const std::size_t steps = motion.steps.size();
    CHECK_FALSE(prover.prove(plan_pose(Vec3d(0, 0, 0.03), Quatd::Identity()),
                             plan_pose(Vec3d(0.1, 0, 0.03), Quatd::Identity()), 12,
                             ProofSearch::kAny, motion));
    CHECK(motion.steps.size() == steps);
    CHECK(prover.is_free(behind));
  }
}
