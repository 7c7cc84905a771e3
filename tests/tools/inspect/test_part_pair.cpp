// SPDX-License-Identifier: Apache-2.0
// Two parts that both move: what is said of them, and C-space as the law sees it.
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/program_run.hpp"
#include "tests/support/text_search.hpp"
#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/scene_facts/facts_text.hpp"
#include "tools/scene_facts/parts_text.hpp"
#include "tools/scene_inspect/c_space_view.hpp"
#include "tools/scene_inspect/part_pair.hpp"

using namespace haptic;
using namespace haptic::tools;
using haptic::sim::test::ScratchFolder;

namespace {

std::string pair_box(const std::string& name, const std::string& role, const std::string& at,
                     const std::string& more = "") {
  return "[[part]]\nname = \"" + name + "\"\nrole = \"" + role +
         "\"\nshape = \"box\"\nsize_m = [0.02, 0.02, 0.02]\nposition_m = [" + at + "]\n" + more;
}

/// A hand's box and a driven one, which is turned by a quarter about z, over a loose one.
SceneBytes three_part_boxes() {
  const ScratchFolder folder("part_pair");
  const std::string path = folder.file("scene.toml");
  std::ofstream(path) << "format = 1\nname = \"boxes\"\n" + pair_box("held", "hand", "0, 0, 0.1") +
                             pair_box("robot", "driven", "0.1, 0, 0.1",
                                      "quaternion = { w = 0.7071067811865476, x = 0, y = 0, z = "
                                      "0.7071067811865476 }\nfastest_m_per_s = 0.2\n"
                                      "fastest_rad_per_s = 1\n") +
                             pair_box("screw", "loose", "0, 0.1, 0.0101") +
                             pair_box("block", "fixed", "0, 0.1, -0.01") +
                             "[rendering]\nk_f_n_per_m = 800\n";
  return SceneBytes(compile_scene(read_scene_file(path), {}).bytes);
}

struct OpenedBoxes {
  SceneBytes bytes = three_part_boxes();
  SceneView view;
  OpenedBoxes() { REQUIRE(SceneView::open(std::as_const(bytes).span(), view) == RtStatus::kOk); }
};

std::string pair_refusal_of(const SceneView& view, const std::string& names) {
  try {
    static_cast<void>(part_pair_of(view, names, "start", "start"));
  } catch (const UsageError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_SUITE("tools.part_pair") {
  TEST_CASE("facts: roles, pairs and bounds of all that moves") {
    const OpenedBoxes scene;
    const SceneFacts facts = facts_of(scene.view);
    REQUIRE(facts.parts.has_value());
    CHECK(facts.parts->moving == 3);
    CHECK(facts.parts->hands == 1);
    CHECK(facts.parts->law_bytes > 0);
    CHECK(facts.parts->bounds.max_work_units > facts.capacity.max_work_units);
    const std::string text = parts_as_text(facts);
    INFO(text);
    for (const char* words : {"driven  'robot'", "loose   'screw'", "fixed   'block'",
                              "up to 3 of them move in one tick", "'held' and 'robot'"})
      CHECK(test::has(text, words));
  }

  TEST_CASE("facts: a scene of one moving part says nothing of parts") {
    SceneFacts facts;
    CHECK(parts_as_text(facts).empty());
  }

  TEST_CASE("pair: the pose of one is that in the axes of the other") {
    const OpenedBoxes scene;
    const PartPair pair = part_pair_of(scene.view, "held,robot", "start", "start");
    CHECK(pair.a == "held");
    CHECK(pair.b == "robot");
    // The way from robot to held is -0.1 along x of W, which is y of the robot, the other way.
    CHECK(static_cast<double>(pair.a_seen_from_b.p_wa[0]) == doctest::Approx(0).epsilon(1e-9));
    CHECK(static_cast<double>(pair.a_seen_from_b.p_wa[1]) == doctest::Approx(0.1));
    const CSpaceView space = c_space_view(pair.view, pair.a_seen_from_b);
    REQUIRE(space.obstacles.size() == 1);
    // Two boxes of 20 mm, 100 mm apart: the point is 80 mm in front of the obstacle.
    CHECK(space.obstacles[0].distance_m == doctest::Approx(0.08).epsilon(1e-6));
    const PartPair moved = part_pair_of(scene.view, "held,robot", "0.05,0,0.1", "start");
    CHECK(c_space_view(moved.view, moved.a_seen_from_b).obstacles[0].distance_m ==
          doctest::Approx(0.03).epsilon(1e-6));
  }

  TEST_CASE("pair: refusals name the parts and the fix") {
    const OpenedBoxes scene;
    CHECK(test::has(pair_refusal_of(scene.view, "held"), "give two names"));
    CHECK(test::has(pair_refusal_of(scene.view, "held,nut"), "the parts are held, robot"));
    CHECK(test::has(pair_refusal_of(scene.view, "held,block"), "never move at once"));
  }
}
