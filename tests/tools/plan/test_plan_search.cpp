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

#include "host_sim/lab/planning/puzzles.hpp"
#include "host_sim/lab/planning/sampled_plan.hpp"
#include "tests/tools/plan/plan_bench.hpp"
#include "tools/c_space/pose_text.hpp"
#include "tools/plan/plan_check.hpp"
#include "tools/plan/plan_limits.hpp"
#include "tools/plan/search/inside_surface.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::tools;
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

/// A block before a plate of 200 x 2 x 200 mm; `more` ends the scene file.
std::string wall_scene(const std::string& more) {
  return "format = 1\nname = \"wall\"\n[moving]\nshape = \"box\"\nsize_m = [0.02, 0.02, 0.04]\n"
         "position_m = [0.0, -0.02, 0.0]\n"
         "[[static]]\nshape = \"box\"\nsize_m = [0.2, 0.002, 0.2]\n"
         "[rendering]\nk_f_n_per_m = 800.0\n" +
         more;
}

/// The plate reaches to 100 mm, and the block 10 mm to the side and 20 mm up: round it leads but
/// one way, over the plate, and with `high_m` less than 0.12 none.
std::string limited_wall(double high_m, double angle_rad) {
  return wall_scene(
      "[motion_limits]\nworkspace = { min_m = [-0.1, -0.1, -0.1], max_m = [0.1, 0.1, " +
      std::to_string(high_m) + "] }\norientation = { max_angle_rad = " + std::to_string(angle_rad) +
      " }\n");
}

/// A peg at the bottom of a tube of 150 mm that a disc closes below.
const std::string kCup =
    "format = 1\nname = \"cup\"\n[moving]\nshape = \"cylinder\"\nradius_m = 0.01\n"
    "height_m = 0.02\nsegments = 12\nposition_m = [0.0, 0.0, -0.05]\n"
    "[[static]]\nshape = \"tube\"\ninner_radius_m = 0.012\nouter_radius_m = 0.02\n"
    "height_m = 0.15\nsegments = 12\n"
    "[[static]]\nshape = \"cylinder\"\nradius_m = 0.02\nheight_m = 0.005\nsegments = 12\n"
    "position_m = [0.0, 0.0, -0.0775]\n[rendering]\nk_f_n_per_m = 800.0\n";

/// Found and shortened with little work.
MadePlan quick_plan(const SceneView& view, const std::string& goal, std::uint64_t most_nodes) {
  SlidingPart part(view);
  StepProver prover(view, plan_tolerance_m(view));
  SearchLimits limits;
  limits.most_nodes = most_nodes;
  ShorteningLimits shortening;
  shortening.work = 100'000'000;
  return make_plan_between(view, part, prover,
                           part.grip_pose(tools::pose_from_text(view, "s", "start")),
                           part.grip_pose(tools::pose_from_text(view, "g", goal)), limits,
                           shortening, [](const SearchState&) {});
}

}  // namespace

TEST_SUITE("tools.plan_search") {
  TEST_CASE("plan: far round a wide wall, and out of a deep cup to below it") {
    for (const auto& [text, goal] : {std::pair{wall_scene(""), "0,0.02,0"}, {kCup, "0,0,-0.12"}}) {
      const PlannedScene scene(text, "detour");
      const MadePlan one = quick_plan(scene.view, goal, 20'000);
      check_plan(scene.view, one);
      const MadePlan same = quick_plan(scene.view, goal, 20'000);
      CHECK(tools::plan_as_text(one.plan) == tools::plan_as_text(same.plan));
    }
  }

  TEST_CASE("sampled plan: RRT steered by the felt part leads into a hole and out of a cup") {
    if (sampling_planners().empty()) {
      MESSAGE("skipped: built without OMPL");
      return;
    }
    const Puzzle peg = peg_puzzle(0.05);
    for (const auto& task : {std::pair{peg.scene, peg.goal}, {kCup, "0,0,0.1"}}) {
      const PlannedScene scene(task.first, "sampled");
      const SlidingPart part(scene.view);
      const auto pose = [&](const std::string& words) {
        return part.grip_pose(tools::pose_from_text(scene.view, "pose", words));
      };
      const auto made = [&] {
        return sampled_plan(scene.view, pose("start"), pose(task.second), 60, 1);
      };
      const std::optional<SampledPlan> found = made();
      REQUIRE(found);
      CHECK(found->planner == "RRT steered by the felt part");
      CHECK(tools::prove_plan(scene.view, found->plan, "p").holds());
      CHECK(tools::plan_as_text(made()->plan) == tools::plan_as_text(found->plan));
    }
  }

  TEST_CASE("plan: every pose is within the scene's workspace and orientation") {
    const PlannedScene scene(limited_wall(0.14, 0.3), "limited");
    const MadePlan made = quick_plan(scene.view, "0,0.02,0", 20'000);
    check_plan(scene.view, made);
    const tools::PlanLimits limits(scene.view.parameters().envelope);
    double highest_m = 0;
    for (const PlanPose& pose : made.plan.poses) {
      CHECK(limits.left_by(pose) == "");
      CHECK(limits.hold(pose));
      highest_m = std::max(highest_m, pose.x0_m[2]);
    }
    CHECK(highest_m > 0.115);
    // The probe: without room above there is no way left.
    const PlannedScene low(limited_wall(0.11, 0.1), "low");
    CHECK_FALSE(quick_plan(low.view, "0,0.02,0", 3'000).search.found);
    CHECK(limits.left_by(made.plan) == "");
    CHECK(tools::PlanLimits(low.view.parameters().envelope)
              .left_by(made.plan)
              .find("leaves the scene's limits: the grip point's z is") != std::string::npos);
  }

  TEST_CASE("plan limits: what leaves them is named with its value") {
    EnvelopeParameters envelope{};
    envelope.q_wa_xyzw[3] = 1;
    const auto turned = [](double angle_rad) {
      return plan_pose(Vec3d::Zero(), exp_of(Vec3d(0, 0, angle_rad)));
    };
    const auto left_by = [&](const PlanPose& pose) {
      return tools::PlanLimits(envelope).left_by(pose);
    };
    CHECK(left_by(plan_pose(Vec3d(9, 9, 9), turn_of(turned(3)))) == "");
    envelope.given = kWorkspaceGiven;
    for (double& x : envelope.max_m) x = 0.5;
    CHECK(left_by(turned(3)) == "");
    CHECK(left_by(plan_pose(Vec3d(0, -0.25, 0), Quatd::Identity())) ==
          "the grip point's y is -0.25 m, and [motion_limits] workspace min_m is 0 m");
    CHECK(left_by(plan_pose(Vec3d(0, 0, 0.75), Quatd::Identity())) ==
          "the grip point's z is 0.75 m, and [motion_limits] workspace max_m is 0.5 m");
    envelope.given = kOrientationGiven;
    CHECK(left_by(turned(1e-3)) ==
          "the part is turned by 0.001 rad from the middle of [motion_limits] orientation, and its "
          "max_angle_rad is 0");
    envelope.max_angle_rad = 2;
    const tools::PlanLimits limits(envelope);
    CHECK(limits.hold(turned(1.99)));
    CHECK(limits.hold(turned(-1.99)));
    CHECK_FALSE(limits.hold(turned(2.01)));
    // From one side to the other the shorter way leads through half a turn.
    CHECK(limits.hold_between(turned(1.5), turned(-1.5)));
    CHECK_FALSE(limits.hold_between(turned(1.9), turned(-1.9)));
  }

  TEST_CASE("plan: the material of a closed surface encloses a part, its bore does not") {
    const auto surface = [](const std::string& shape) {
      return "format = 1\nname = \"shell\"\n[moving]\nshape = \"box\"\n"
             "size_m = [0.01, 0.01, 0.01]\nposition_m = [0.0, 0.0, 0.2]\n[[static]]\n" +
             shape + "as = \"surface\"\n[rendering]\nk_f_n_per_m = 800.0\n";
    };
    const auto at = [](double x_m) { return plan_pose(Vec3d(x_m, 0, 0), Quatd::Identity()); };
    const PlannedScene box(surface("shape = \"box\"\nsize_m = [0.1, 0.1, 0.1]\n"), "box");
    CHECK(enclosing_body(box.view, at(0)) == 1);
    CHECK(enclosing_body(box.view, at(0.04)) == 1);
    CHECK_FALSE(enclosing_body(box.view, at(0.06)));
    const PlannedScene tube(surface("shape = \"tube\"\ninner_radius_m = 0.02\n"
                                    "outer_radius_m = 0.06\nheight_m = 0.1\nsegments = 16\n"),
                            "tube");
    CHECK_FALSE(enclosing_body(tube.view, at(0)));
    CHECK(enclosing_body(tube.view, at(0.04)) == 1);
    CHECK_FALSE(enclosing_body(tube.view, at(0.08)));
    const PlannedScene solid(wall_scene(""), "solid");
    CHECK_FALSE(enclosing_body(solid.view, at(0)));
  }

  TEST_CASE("step prover: nothing beyond the scene's limits is free") {
    const PlannedScene scene(limited_wall(0.14, 2), "limited");
    StepProver prover(scene.view, plan_tolerance_m(scene.view));
    const auto at = [](double z_m, double angle_rad) {
      return plan_pose(Vec3d(0, -0.05, z_m), exp_of(Vec3d(0, 0, angle_rad)));
    };
    CHECK(prover.is_free(at(0.139, 0)));
    CHECK_FALSE(prover.is_free(at(0.141, 0)));
    CHECK_FALSE(prover.is_free(at(0, 2.1)));
    CHECK(prover.prove(at(0, 0), at(0.139, 1.9), 12));
    CHECK_FALSE(prover.prove(at(0, 0), at(0.141, 0), 12));
    CHECK_FALSE(prover.prove(at(0, 1.9), at(0, -1.9), 12));
  }

  TEST_CASE("plan: scenes of the gallery") {
    for (const auto& task : {std::pair{"square_peg_five", "0,0,-39mm,1,0,0,0"},
                             {"ell_insert", "0,0,-19.9mm,1,0,0,0"},
                             {"dovetail", "0,0,0.1mm,1,0,0,0"},
                             {"two_pins", "0,0,0.1mm,1,0,0,0"},
                             {"gear_on_shaft", "0,0,-24.9mm,1,0,0,0"}}) {
      CAPTURE(task.first);
      const PlannedScene scene{std::string(task.first)};
      check_plan(scene.view, plan_to(scene.view, task.second));
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
