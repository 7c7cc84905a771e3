// SPDX-License-Identifier: Apache-2.0
// Translations from the cells of the free places: plans, facts that there is none, and the harmonic
// function along a channel.
#include <doctest/doctest.h>

#include <cmath>
#include <set>
#include <string>

#include "host_sim/lab/planning/puzzles.hpp"
#include "tests/tools/plan/plan_bench.hpp"
#include "tools/c_space/pose_text.hpp"
#include "tools/common/split_mix.hpp"
#include "tools/plan/plan_check.hpp"
#include "tools/plan/search/harmonic_field.hpp"
#include "tools/plan/search/translation_plan.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::tools;
using namespace haptic::sim::test;

namespace {

/// A scene with the two ends of a motion in it.
struct Trial {
  Trial(const std::string& scene_text, const std::string& goal_text)
      : scene(scene_text, "trial"), part(scene.view), prover(scene.view, tolerance_m()) {
    start_wa = tools::pose_from_text(scene.view, "--start", "start");
    start = part.grip_pose(start_wa);
    goal = part.grip_pose(tools::pose_from_text(scene.view, "--goal", goal_text));
  }
  [[nodiscard]] double tolerance_m() const { return 0.995 * tools::most_tolerance_m(scene.view); }
  [[nodiscard]] TranslationResult plan() {
    return plan_translation(scene.view, prover, start_wa, start, goal, tolerance_m());
  }
  [[nodiscard]] tools::PlanProof prove(const CorneredMotion& motion) {
    const tools::Plan plan = make_plan(motion, prover, tools::PlanCheck(scene.view),
                                       {"trial", 1, tolerance_m(), 5e-5, part.radius_m()});
    return tools::prove_plan(scene.view, plan, "p");
  }

  PlannedScene scene;
  SlidingPart part;
  StepProver prover;
  Pose start_wa;
  PlanPose start, goal;
};

std::vector<Vec3d> places(const CorneredMotion& motion) {
  std::vector<Vec3d> all;
  for (const PlanPose& pose : motion.corners) all.push_back(place_of(pose));
  return all;
}

/// A cube of 10 mm in a closed duct 12 mm wide and high, which leaves it 2 x 2 x 90 mm.
const std::string kDuct =
    "format = 1\nname = \"duct\"\n[moving]\nshape = \"box\"\nsize_m = [0.01, 0.01, 0.01]\n"
    "position_m = [-0.045, 0.0, 0.0]\n"
    "[[static]]\nshape = \"box\"\nsize_m = [0.12, 0.04, 0.01]\nposition_m = [0.0, 0.0, 0.011]\n"
    "[[static]]\nshape = \"box\"\nsize_m = [0.12, 0.04, 0.01]\nposition_m = [0.0, 0.0, -0.011]\n"
    "[[static]]\nshape = \"box\"\nsize_m = [0.12, 0.01, 0.012]\nposition_m = [0.0, 0.011, 0.0]\n"
    "[[static]]\nshape = \"box\"\nsize_m = [0.12, 0.01, 0.012]\nposition_m = [0.0, -0.011, 0.0]\n"
    "[[static]]\nshape = \"box\"\nsize_m = [0.01, 0.012, 0.012]\nposition_m = [0.055, 0.0, 0.0]\n"
    "[[static]]\nshape = \"box\"\nsize_m = [0.01, 0.012, 0.012]\nposition_m = [-0.055, 0.0, 0.0]\n"
    "[rendering]\nk_f_n_per_m = 800.0\n[motion_limits]\norientation = { max_angle_rad = 0.0 }\n";

}  // namespace

TEST_SUITE("tools.translations") {
  TEST_CASE("cells: a cut cube keeps its volume by every plane") {
    tools::SplitMix64 words(7);
    const auto centred = [&] { return 2 * words.uniform() - 1; };
    const ConvexCell cube = box_cell(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
    CHECK(cube.volume_m3() == doctest::Approx(8).epsilon(1e-12));
    for (int k = 0; k < 500; ++k) {
      CAPTURE(k);
      ConvexCell cell = cube;
      double left = 8;
      for (int n = 0; n < 6; ++n) {
        const Vec3d normal = Vec3d(centred(), centred(), centred()).normalized();
        const CutCell halves = cut(cell, normal, 0.7 * centred());
        double sum = 0;
        for (const ConvexCell* half : {&halves.below, &halves.above}) {
          if (!half->sides.empty()) sum += half->volume_m3();
        }
        CHECK(sum == doctest::Approx(left).epsilon(1e-6));
        if (halves.below.sides.empty()) break;
        cell = halves.below;
        left = cell.volume_m3();
        CHECK(cell.outside_m(cell.centre()) < 0);
      }
    }
  }

  TEST_CASE("cells: random places are in a cell exactly where a plane of every pair proves them") {
    Trial trial(chamber_puzzle(0.5).scene, chamber_puzzle(0.5).goal);
    const Vec3d places[] = {place_of(trial.start), place_of(trial.goal)};
    const TranslationSpace space =
        make_translation_space(trial.scene.view, trial.start_wa, places, trial.tolerance_m());
    REQUIRE(space.undecided == "");
    tools::SplitMix64 words(3);
    int free = 0;
    for (int k = 0; k < 4000; ++k) {
      const Vec3d x =
          0.06 * Vec3d(2 * words.uniform() - 1, 2 * words.uniform() - 1, 2 * words.uniform() - 1);
      const bool proved = trial.prover.is_free(plan_pose(x, turn_of(trial.start)));
      const bool in_cell = !space.cells_at(x).empty();
      free += proved ? 1 : 0;
      CHECK(proved == in_cell);
    }
    CHECK(free > 400);
    CHECK(free < 3600);
  }

  TEST_CASE("translations: out of the chamber by 1 um of clearance, and not without") {
    for (const double clearance_mm : {1.0, 0.05, 0.001}) {
      CAPTURE(clearance_mm);
      const Puzzle puzzle = chamber_puzzle(clearance_mm);
      Trial trial(puzzle.scene, puzzle.goal);
      CHECK(trial.scene.view.is_locked());
      const TranslationResult found = trial.plan();
      CHECK(found.why == "");
      REQUIRE(found.verdict == TranslationVerdict::kFound);
      const CorneredMotion motion =
          shortened(found.motion, trial.prover, trial.part.radius_m(), {});
      const tools::PlanProof proof = trial.prove(motion);
      CHECK(proof.failure == "");
      CHECK(proof.certified == proof.steps);
    }
    // The scene's text has whole micrometres: 1 um too little leaves 0.5 um to either side, less
    // than the 0.84 um that count as free in single precision, where cells are known to 0.4 um
    // besides.
    const double least_mm = HAPTIC_REAL_IS_FLOAT ? -0.004 : -0.001;
    for (const double clearance_mm : {least_mm, -0.2}) {
      CAPTURE(clearance_mm);
      const Puzzle puzzle = chamber_puzzle(clearance_mm);
      Trial trial(puzzle.scene, puzzle.goal);
      const TranslationResult found = trial.plan();
      CHECK(found.verdict == TranslationVerdict::kImpossible);
      CHECK_FALSE(found.goal_is_enclosed);
      // The chamber leaves the middle of the cube 40 mm; where the hole is, it gets no farther.
      const double slack = 2 * found.space.tolerance_m;
      for (int axis = 0; axis < 3; ++axis) {
        CHECK(std::abs(found.enclosure.low[axis] + 0.020) < slack);
        CHECK(std::abs(found.enclosure.high[axis] - 0.020) < slack);
      }
      // Floor, four walls, and the four plates of the lid.
      std::set<std::uint32_t> pieces;
      double area = 0;
      for (const BlockingFace& face : found.enclosure.faces) {
        pieces.insert(trial.scene.view.pair_record(face.pair).piece_b);
        area += face.area_m2;
        CHECK(face.normal_w.cwiseAbs().maxCoeff() > 1 - 1e-12);
        CHECK_FALSE(face.nodes.empty());
      }
      CHECK(pieces.size() == 9);
      // Sides of a cube of 40 mm; the plates of the lid overlap in C-space.
      CHECK(area > 6 * 0.04 * 0.04 * 0.999);
    }
  }

  TEST_CASE("translations: a cube in a cage is shut in by the six C-faces about it") {
    const Puzzle puzzle = cage_puzzle();
    Trial trial(puzzle.scene, puzzle.goal);
    const TranslationResult found = trial.plan();
    REQUIRE(found.verdict == TranslationVerdict::kImpossible);
    CHECK(found.enclosure.faces.size() == 6);
    for (const BlockingFace& face : found.enclosure.faces) {
      CHECK(face.area_m2 == doctest::Approx(4e-6).epsilon(1e-3));
      CHECK(std::abs(face.offset_m + 0.001) < 1e-9);
    }
    CHECK(found.enclosure.high[2] == doctest::Approx(0.001).epsilon(1e-3));
  }

  TEST_CASE("translations: a round peg over its hole, whose C-obstacles have many faces") {
    const PlannedScene gallery("two_pins");
    SlidingPart part(gallery.view);
    const double tolerance_m = 0.995 * tools::most_tolerance_m(gallery.view);
    StepProver prover(gallery.view, tolerance_m);
    const Pose start_wa = tools::pose_from_text(gallery.view, "--start", "0,0,40mm,1,0,0,0");
    const PlanPose start = part.grip_pose(start_wa);
    const PlanPose goal =
        part.grip_pose(tools::pose_from_text(gallery.view, "--goal", "0,0,0.1mm,1,0,0,0"));
    const TranslationResult found =
        plan_translation(gallery.view, prover, start_wa, start, goal, tolerance_m);
    CHECK(found.why == "");
    CHECK(found.verdict == TranslationVerdict::kFound);
    MESSAGE(found.space.faces.size()
            << " C-faces, " << found.space.cells.size() << " cells, " << found.seconds << " s");
  }

  TEST_CASE("harmonic function: linear along a straight duct") {
    Trial trial(kDuct, "45mm,0,0,1,0,0,0");
    const TranslationResult found = trial.plan();
    REQUIRE(found.verdict == TranslationVerdict::kFound);
    const HarmonicField field = make_harmonic_field(
        found.space, std::vector<Vec3d>{place_of(trial.start), place_of(trial.goal)});
    CHECK(field.residual < 1e-12);
    REQUIRE(field.cells.size() > 20);
    double volume = 0;
    const double begin = field.cells[field.start_cell].centre()[0];
    const double end = field.cells[field.goal_cell].centre()[0];
    for (std::size_t k = 0; k < field.cells.size(); ++k) {
      const Vec3d centre = field.cells[k].centre();
      volume += field.cells[k].volume_m3();
      const double share = std::clamp((end - centre[0]) / (end - begin), 0.0, 1.0);
      CHECK(std::abs(field.value[k] - share) < 0.03);
      const bool inner = centre[0] > begin + 0.01 && centre[0] < end - 0.01;
      if (inner) CHECK(field.descent[k][0] > 0.99);
    }
    CHECK(volume == doctest::Approx(0.002 * 0.002 * 0.090).epsilon(1e-3));
  }

  TEST_CASE("harmonic function: no least value but the goal's, and a plan that is proved") {
    for (const double clearance_mm : {1.0, 0.05}) {
      CAPTURE(clearance_mm);
      const Puzzle puzzle = chamber_puzzle(clearance_mm);
      Trial trial(puzzle.scene, puzzle.goal);
      const TranslationResult found = trial.plan();
      REQUIRE(found.verdict == TranslationVerdict::kFound);
      const CorneredMotion about = shortened(found.motion, trial.prover, trial.part.radius_m(), {});
      const HarmonicField field = make_harmonic_field(found.space, places(about));
      for (std::uint32_t k = 0; k < field.cells.size(); ++k) {
        CHECK(field.value[k] > -1e-9);
        CHECK(field.value[k] < 1 + 1e-9);
      }
      CorneredMotion down;
      for (const Vec3d& x : descend(field, place_of(trial.start), place_of(trial.goal)))
        down.corners.push_back(plan_pose(x, turn_of(trial.start)));
      const tools::PlanProof proof = trial.prove(down);
      CHECK(proof.failure == "");
      CHECK(proof.certified == proof.steps);
      const double shortest = about.length_m(1), length = down.length_m(1);
      CHECK(length < 2 * shortest);
      MESSAGE(field.cells.size() << " cells, " << field.rounds << " rounds; " << 1e3 * length
                                 << " mm, shortest " << 1e3 * shortest << " mm");
    }
  }

  TEST_CASE("translations: round a wall as far as the workspace allows") {
    const auto wall = [](const std::string& high_m) {
      return "format = 1\nname = \"wall\"\n[moving]\nshape = \"box\"\n"
             "size_m = [0.02, 0.02, 0.04]\nposition_m = [0.0, -0.02, 0.0]\n"
             "[[static]]\nshape = \"box\"\nsize_m = [0.2, 0.002, 0.2]\n"
             "[rendering]\nk_f_n_per_m = 800.0\n[motion_limits]\n"
             "workspace = { min_m = [-0.1, -0.1, -0.1], max_m = [0.1, 0.1, " +
             high_m + "] }\norientation = { max_angle_rad = 0.0 }\n";
    };
    Trial over(wall("0.125"), "0,0.02,0");
    const TranslationResult found = over.plan();
    REQUIRE(found.verdict == TranslationVerdict::kFound);
    CHECK(over.prove(found.motion).holds());
    for (const Vec3d& x : places(found.motion)) {
      CHECK(x.cwiseAbs().head<2>().maxCoeff() <= 0.1);
      CHECK(x.z() <= 0.125);
    }
    Trial shut(wall("0.115"), "0,0.02,0");
    CHECK(shut.plan().verdict == TranslationVerdict::kImpossible);
  }

  TEST_CASE("translations: a surface is not decided, and says why") {
    const PlannedScene scene(
        "format = 1\nname = \"surface\"\n[moving]\nshape = \"box\"\nsize_m = [0.01, 0.01, 0.01]\n"
        "position_m = [0.0, 0.0, 0.1]\n[[static]]\nmesh = \"ell_insert/recess.off\"\nscale_to_m = "
        "0.001\nas = \"surface\"\n[rendering]\nk_f_n_per_m = 800.0\n",
        "surface");
    REQUIRE(is_flat(scene.view.pieces().back()));
    const TranslationSpace space = make_translation_space(
        scene.view, tools::pose_from_text(scene.view, "--start", "start"), {}, 1e-7);
    CHECK(space.undecided.find("surfaces") != std::string::npos);
  }
}
