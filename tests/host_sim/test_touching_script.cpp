// SPDX-License-Identifier: Apache-2.0
// host_sim motion --for: a motion that touches, found from the scene; and the way from two meshes
// to a force in four commands.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host_sim/session/motion_csv.hpp"
#include "host_sim/session/replay.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "host_sim/touching/touching_motion.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/formatted.hpp"

using namespace haptic;
using namespace haptic::sim;
using haptic::sim::test::ProgramResult;
using haptic::sim::test::run_program;

namespace {

/// A cube of 20 mm at the origin of W, and a block.
std::vector<std::byte> cube_and_block(const Vector& low, const Vector& high, LawId law) {
  const Solid block = box_solid("block", low, high);
  return scene_of(centred_box("cube", 0.01, 0.01, 0.01), {&block, 1}, 800, 1e-4, law);
}

constexpr const char* kRing =
    "[moving]\nshape = \"tube\"\ninner_radius_m = 0.02\nouter_radius_m = 0.03\n"
    "height_m = 0.01\nposition_m = [0, 0, 0.04]\n";

/// A scene file, compiled by the program.
struct TestScene {
  TestScene(const std::string& name, const std::string& moving, const std::string& rest)
      : folder(name) {
    std::ofstream(folder.file("scene.toml"))
        << "format = 1\nname = \"" << name << "\"\n"
        << moving << rest << "[rendering]\nk_f_n_per_m = 800\n";
    compile(folder.file("scene.toml"));
  }
  /// One of the project's own.
  explicit TestScene(const std::string& name) : folder(name) {
    compile(std::string(HAPTIC_SCENES_DIR) + "/" + name + "/scene.toml");
  }
  void compile(const std::string& file) {
    path = folder.file("s.rtscene");
    const ProgramResult result =
        run_program(HAPTIC_GRAPH_COMPILER, "'" + file + "' -o '" + path + "'");
    CAPTURE(result.err);
    REQUIRE(result.exit_code == 0);
  }
  test::ScratchFolder folder;
  std::string path;
};

double touched_share(const TouchingMotion& made) {
  const auto touched =
      std::ranges::count_if(made.played.ticks, [](const TickRecord& t) { return t.in_contact; });
  return static_cast<double>(touched) / static_cast<double>(made.played.ticks.size());
}

TouchingOptions with_way_in() {
  TouchingOptions options;
  options.find_way_in = find_way_in;
  return options;
}

}  // namespace

TEST_SUITE("host_sim.touching_script") {
  TEST_CASE("the approach goes along the axis that touches soonest, as far as the touch") {
    for (const LawId law : {LawId::kPaper, LawId::kProxy}) {
      CAPTURE(law_name(law));
      CoreSession session(cube_and_block({-0.1, -0.1, -0.08}, {0.1, 0.1, -0.03}, law), "block");
      const TouchingMotion made = touching_motion(session, with_way_in());
      const TouchingScript& touching = made.touching;
      CHECK(made.not_touched.empty());
      CHECK(way_text(touching.along_w) == "-z");
      CHECK(touching.way_m >= 0.02);
      CHECK(touching.way_m <= 0.02 + kTouchStep_m);
      const std::vector<MotionSample> motion = make_motion(touching.script);
      CHECK(motion.front().p[2] == doctest::Approx(0));
      CHECK(motion.back().p[2] == doctest::Approx(0));
      const ReplayResult played = replay(session, motion, {});
      double largest_n = 0, largest_side_n = 0;
      for (const TickRecord& tick : played.ticks) {
        largest_n = std::max(largest_n, length_of(tick.force_n));
        largest_side_n = std::max(largest_side_n, std::hypot(tick.force_n[0], tick.force_n[1]));
      }
      // Presses by 3 mm and what a step of the search goes too far; no friction, so no side force.
      CHECK(largest_n > 0.99 * 800 * touching.press_m);
      CHECK(largest_n < 8.0);
      CHECK(largest_side_n < 0.5);
      CHECK(length_of(played.ticks.front().force_n) == 0);
      CHECK(length_of(played.ticks.back().force_n) < 1e-5);  // free, but for rounding
    }
  }

  TEST_CASE("no axis touches: towards the nearest piece") {
    CoreSession session(cube_and_block({0.05, 0.05, 0.05}, {0.09, 0.09, 0.09}, LawId::kProxy),
                        "block");
    const TouchingScript touching = touching_motion(session, with_way_in()).touching;
    CHECK(way_text(touching.along_w) == "(0.577, 0.577, 0.577)");
    CHECK(touching.way_m >= 0.04 * std::sqrt(3.0));
    CHECK(touching.way_m <= 0.04 * std::sqrt(3.0) + kTouchStep_m);
  }

  TEST_CASE("a part smaller than a step of the search touches a part that is smaller still") {
    const TestScene scene("tiny", "[moving]\nshape = \"box\"\nsize_m = [1e-4, 1e-4, 1e-4]\n",
                          "[[static]]\nshape = \"box\"\nsize_m = [2e-5, 2e-5, 2e-5]\n"
                          "position_m = [0, 0, 1e-4]\n");
    CoreSession session(scene.path);
    const HeldPart held = held_at_start(session.view());
    CHECK(touch_step_m(held) < 2e-5);
    CHECK(touch_step_m({.radius_m = 0.01}) == kTouchStep_m);
    const WayToTouch way = way_to_touch(session, held, Vector::UnitZ());
    REQUIRE(way.length_m);
    CHECK(*way.length_m >= 4e-5);
    CHECK(*way.length_m <= 4e-5 + 2 * touch_step_m(held));
    CHECK(touching_motion(session, with_way_in()).not_touched == "");
  }

  TEST_CASE("a ring around a pin: to the nearest places, where no axis and no middle touches") {
    const TestScene scene("ring", kRing,
                          "[[static]]\nshape = \"box\"\nsize_m = [0.01, 0.01, 0.02]\n");
    CoreSession session(scene.path);
    const TouchingMotion made = touching_motion(session, with_way_in());
    CHECK(made.not_touched == "");
    CHECK(made.touching.way_in.empty());
    CHECK(std::abs(made.touching.along_w.z()) < 0.999);
    CHECK(touched_share(made) > 0.3);
    CHECK(length_of(made.played.ticks.back().force_n) < 1e-5);
  }

  TEST_CASE("a part that belongs inside others is led in by the way that the planner finds") {
    const TestScene scene("gear_on_shaft");
    CoreSession session(scene.path);
    const TouchingMotion made = touching_motion(session, with_way_in());
    CHECK(made.not_touched == "");
    REQUIRE(made.touching.way_in.size() > 2);
    // The way in ends where the files have the part.
    const HeldPart there = held_at(session.view(), made.touching.way_in.back());
    CHECK(there.mesh_pose().p_wa.norm() < 1e-9);
    CHECK(touched_share(made) > 0.3);
    CHECK(made.touching.way_m < there.radius_m);
  }

  TEST_CASE("limits that keep the part from every fixed one: no motion, and what helps") {
    const TestScene scene(
        "shut",
        "[moving]\nshape = \"box\"\nsize_m = [0.01, 0.01, 0.01]\nposition_m = [0, 0, -0.05]\n",
        "[[static]]\nshape = \"box\"\nsize_m = [0.02, 0.02, 0.01]\nposition_m = [0, 0, 0.02]\n"
        "[motion_limits]\nworkspace = { min_m = [-1, -1, -1], max_m = [1, 1, 0.0098] }\n");
    const std::string out = scene.folder.file("m.csv");
    const ProgramResult result =
        run_program(HAPTIC_HOST_SIM, "motion --for '" + scene.path + "' -o '" + out + "'");
    CHECK(result.exit_code == 1);
    CHECK(result.out.starts_with("FAILED: " + scene.path + ": the part meets no fixed part on "));
    CHECK(
        result.out.ends_with("[motion_limits] workspace: widen it, or move the fixed parts; no "
                             "motion is written\n"));
    CHECK_FALSE(std::filesystem::exists(out));
  }

  TEST_CASE("a part that starts metres away is refused with the keys to look at") {
    CoreSession session(cube_and_block({-0.1, -0.1, -5.1}, {0.1, 0.1, -5.0}, LawId::kProxy),
                        "far.rtscene");
    const TouchingMotion made = touching_motion(session, with_way_in());
    CHECK(made.motion.empty());
    CHECK(made.not_touched.find("the part starts 4.99 m away from the first touch") == 0);
    CHECK(made.not_touched.find("give [moving] position_m in metres") != std::string::npos);
  }

  TEST_CASE("two meshes to a force in four commands: init, compile, motion, replay") {
    const test::ScratchFolder folder("chain");
    const auto at = [&](const char* name) { return "'" + folder.file(name) + "'"; };
    for (const char* mesh : {"peg.off", "socket.obj"}) {
      std::filesystem::copy(std::string(HAPTIC_SCENES_DIR) + "/square_peg_five/" + mesh,
                            folder.file(mesh));
    }
    const auto done = [](const char* program, const std::string& arguments) {
      ProgramResult result = run_program(program, arguments);
      CAPTURE(arguments);
      CAPTURE(result.err);
      REQUIRE(result.exit_code == 0);
      return result.out;
    };
    done(HAPTIC_GRAPH_COMPILER,
         "init " + at("peg.off") + " " + at("socket.obj") + " -o " + at("scene.toml"));
    done(HAPTIC_GRAPH_COMPILER, at("scene.toml") + " -o " + at("peg.rtscene"));
    const std::string said =
        done(HAPTIC_HOST_SIM, "motion --for " + at("peg.rtscene") + " -o " + at("m.csv"));
    CHECK(said.find("mm along -z until the part touches") != std::string::npos);
    CHECK(said.find("played once: in contact in") != std::string::npos);
    const auto summary = nlohmann::json::parse(done(
        HAPTIC_HOST_SIM, "replay " + at("peg.rtscene") + " --motion " + at("m.csv") + " --json"));
    CHECK(summary.at("contact_ticks").get<int>() > 1000);
    const double force_n = summary.at("largest_force_n").get<double>();
    CHECK(force_n > 1.0);
    CHECK(force_n < 10.0);
    CHECK(summary.at("largest_torque_nm").get<double>() > 0.01);
    // What it says is what a replay finds.
    CHECK(said.find("up to " + tools::short_number(force_n, 3) + " N") != std::string::npos);
  }

  TEST_CASE("neither a script nor a scene, and both, are usage") {
    for (const char* words : {"motion -o m.csv", "motion a.toml --for b.rtscene -o m.csv"}) {
      const ProgramResult result = run_program(HAPTIC_HOST_SIM, words);
      CHECK(result.exit_code == 2);
      CHECK(result.err.find("give a motion script, or --for SCENE") != std::string::npos);
    }
  }

  TEST_CASE("the motion that is played is the one that a file has, digit for digit") {
    // A start and a part of which no place is a whole number of nanometres.
    const TestScene scene("touching_digits",
                          "[moving]\nshape = \"cylinder\"\nradius_m = 0.0129673251\nheight_m = "
                          "0.0353050025\nposition_m = [0, 0, 0.03604482091]\n",
                          "[[static]]\nshape = \"box\"\nsize_m = [0.1, 0.1, 0.02]\n");
    CoreSession session(scene.path);
    const TouchingMotion made = touching_motion(session, with_way_in());
    REQUIRE(made.not_touched.empty());
    const std::string file = scene.folder.file("m.csv");
    write_motion_csv(file, made.motion);
    const std::vector<MotionSample> written = read_motion_csv(file);
    REQUIRE(written.size() == made.motion.size());
    std::size_t unlike = 0;
    for (std::size_t k = 0; k < written.size(); ++k) {
      const MotionSample &a = written[k], &b = made.motion[k];
      unlike += a.t_s != b.t_s || !std::equal(a.p, a.p + 3, b.p) ||
                        !std::equal(a.q_wxyz, a.q_wxyz + 4, b.q_wxyz)
                    ? 1U
                    : 0U;
    }
    CHECK(unlike == 0);
    session.core().reset();
    const ReplayResult replayed = replay(session, written, {});
    CHECK(replayed.ticks.back().state_hash == made.played.ticks.back().state_hash);
  }
}
