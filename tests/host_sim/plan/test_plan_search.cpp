// SPDX-License-Identifier: Apache-2.0
// Plans through tight and twisting places; what they must turn, slide and enter for is in the
// names.
#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "host_sim/plan/puzzles.hpp"
#include "tests/host_sim/plan/plan_bench.hpp"
#include "tools/c_space/pose_text.hpp"
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
    for (const double clearance_mm : {2.0, 0.2}) check_puzzle(corner_puzzle(clearance_mm));
  }

  TEST_CASE("plan: an L goes through a window, one arm after the other") {
    for (const double clearance_mm : {2.0, 0.2}) check_puzzle(window_puzzle(clearance_mm));
  }

  TEST_CASE("plan: a bar goes through a slot and turns behind it") {
    check_puzzle(slot_puzzle(0.1));
  }

  TEST_CASE("plan: a ring turns over the elbow of a bar") { check_puzzle(ring_puzzle(0.5)); }

  TEST_CASE("plan: a blade twists through the slots of five plates") {
    check_puzzle(twist_puzzle(0.5));
  }

  TEST_CASE("plan: with 0.1 mm too little there is a way neither through nor round") {
    for (const auto make : {corner_puzzle, window_puzzle, slot_puzzle, ring_puzzle, twist_puzzle}) {
      const Puzzle puzzle = make(-0.1);
      CAPTURE(puzzle.name);
      const PlannedScene scene(puzzle.scene, puzzle.name);
      SlidingPart part(scene.view);
      StepProver prover(scene.view, plan_tolerance_m(scene.view));
      SearchLimits limits;
      limits.most_nodes = 150;
      const SearchResult result = search_plan(
          scene.view, part, prover, part.grip_pose(tools::pose_from_text(scene.view, "s", "start")),
          part.grip_pose(tools::pose_from_text(scene.view, "g", puzzle.goal)), limits,
          [](const SearchState&) {});
      CHECK_FALSE(result.found);
      CHECK_FALSE(result.timed_out);
    }
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
    const Puzzle puzzle = window_puzzle(1);
    const std::string& goal = puzzle.goal;
    const PlannedScene scene(puzzle.scene, puzzle.name);
    const MadePlan one = plan_to(scene.view, goal, 7), same = plan_to(scene.view, goal, 7),
                   other = plan_to(scene.view, goal, 8);
    check_plan(scene.view, one);
    check_plan(scene.view, other);
    CHECK(tools::plan_as_text(one.plan) == tools::plan_as_text(same.plan));
    CHECK(tools::plan_as_text(one.plan) != tools::plan_as_text(other.plan));
  }

  TEST_CASE("plan: a machine that is slow while it shortens writes the same bytes") {
    const Puzzle puzzle = corner_puzzle(1);
    const PlannedScene scene(puzzle.scene, puzzle.name);
    struct Seen {
      std::uint64_t work;
      double seconds;  ///< of the processor, and those in which it was held up
    };
    const auto processor_s = [] {
      return static_cast<double>(std::clock()) / static_cast<double>(CLOCKS_PER_SEC);
    };
    struct Watched {
      std::string text;
      std::vector<Seen> seen;
      double seconds = 0;
      std::uint64_t work = 0;
      /// Work at which a limit of time would have ended it.
      [[nodiscard]] std::uint64_t work_after(double s) const {
        const auto at = std::ranges::find_if(seen, [&](const Seen& x) { return x.seconds > s; });
        return at == seen.end() ? work : at->work;
      }
    };
    // Held up by `delay_s` after each share of `share` of work.
    const auto run = [&](std::uint64_t most_work, std::uint64_t share, double delay_s) {
      SlidingPart part(scene.view);
      StepProver prover(scene.view, plan_tolerance_m(scene.view));
      const PlanPose start = part.grip_pose(tools::pose_from_text(scene.view, "s", "start"));
      const PlanPose goal = part.grip_pose(tools::pose_from_text(scene.view, "g", puzzle.goal));
      ShorteningLimits limits;
      limits.work = most_work;
      Watched watched;
      std::uint64_t next = share;
      std::optional<double> began_s;
      double held_s = 0;
      const auto watch = [&](const ShorteningState& state) {
        if (!began_s) began_s = processor_s();
        if (state.work >= next && delay_s > 0) {
          next = state.work + share;
          std::this_thread::sleep_for(std::chrono::duration<double>(delay_s));
          held_s += delay_s;
        }
        watched.seen.push_back({state.work, processor_s() - *began_s + held_s});
      };
      const MadePlan made = make_plan_between(
          scene.view, part, prover, start, goal, {}, limits, [](const SearchState&) {}, watch);
      REQUIRE(made.search.found);
      watched.text = tools::plan_as_text(made.plan);
      watched.work = made.shorten_work;
      watched.seconds = watched.seen.back().seconds;
      return watched;
    };
    const Watched plain = run(kShorteningWork, 0, 0);
    const Watched starved = run(kShorteningWork, plain.work / 20, plain.seconds / 4);
    CHECK(starved.seconds > 3 * plain.seconds);
    CHECK(starved.work == plain.work);
    CHECK(starved.text == plain.text);
    // So does a machine whose work ends by its limit.
    const Watched early = run(plain.work / 10, 0, 0);
    CHECK(run(plain.work / 10, plain.work / 100, plain.seconds / 20).text == early.text);
    // The probe: a limit of time ends the two elsewhere, and that changes the bytes.
    CHECK(starved.work_after(plain.seconds / 2) < plain.work_after(plain.seconds / 2));
    CHECK(early.text != plain.text);
  }

  TEST_CASE("step prover: a step through a thin wall is not proved, one past it is") {
    const PlannedScene scene(window_puzzle(2).scene, "window");
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
