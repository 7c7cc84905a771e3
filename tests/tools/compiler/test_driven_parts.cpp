// SPDX-License-Identifier: Apache-2.0
// Scene files with parts that their owner moves, from the text to the compiled scenes: a peg and a
// ring over a table, and a box that pushes them.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "rt_core/bodies/joint_motion.hpp"
#include "rt_core/scene/part_scenes.hpp"
#include "tests/support/program_run.hpp"
#include "tests/support/text_search.hpp"
#include "tests/tools/compiler/part_scenes.hpp"
#include "tools/common/changed_scene.hpp"
#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/graph/part_tables.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/report.hpp"
#include "tools/scene_facts/facts_text.hpp"

using namespace haptic;
using namespace haptic::tools;

namespace {

constexpr const char* kPushedHead =
    "format = 1\nname = \"pushed\"\n"
    "[rendering]\nk_f_n_per_m = 800\n";
constexpr const char* kPushedTable =
    "[[part]]\nname = \"table\"\nrole = \"fixed\"\nshape = \"box\"\nsize_m = [0.2, 0.2, 0.02]\n"
    "position_m = [0, 0, -0.01]\n";
constexpr const char* kPushedPeg =
    "[[part]]\nname = \"peg\"\nrole = \"hand\"\nshape = \"cylinder\"\nsegments = 16\n"
    "radius_m = 0.005\nheight_m = 0.04\nposition_m = [0, 0, 0.06]\nmaterial = \"pom\"\n";
constexpr const char* kPushedRing =
    "[[part]]\nname = \"ring\"\nrole = \"placed\"\nshape = \"tube\"\nsegments = 16\n"
    "inner_radius_m = 0.0055\nouter_radius_m = 0.009\nheight_m = 0.006\n"
    "position_m = [0.04, 0, 0.00301]\n";
/// A quarter turn about z from W.
constexpr const char* kPusher =
    "[[part]]\nname = \"pusher\"\nrole = \"driven\"\nshape = \"box\"\nsize_m = [0.03, 0.04, 0.02]\n"
    "position_m = [0.1, 0.02, 0.05]\nmaterial = \"steel\"\n"
    "quaternion = { w = 0.7071067811865476, x = 0, y = 0, z = 0.7071067811865476 }\n"
    "fastest_m_per_s = 0.25\nfastest_rad_per_s = 2\n";

std::string pushed_parts() {
  std::string text(kPushedHead);
  for (const char* part : {kPushedTable, kPushedPeg, kPusher, kPushedRing}) text.append(part);
  return text;
}

std::string with_line(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

/// A compiled scene of parts: peg 0, table 1, pusher 2, ring 3 where all are there.
struct Pushed {
  explicit Pushed(const std::string& text, const std::filesystem::path& folder = ".")
      : compiled(compile_scene(parse_scene_file(text, "parts.toml", folder), {})),
        blob(compiled.bytes) {
    REQUIRE(SceneView::open(blob.span(), view) == RtStatus::kOk);
    REQUIRE(PartScenes::open(view, parts) == RtStatus::kOk);
  }
  [[nodiscard]] SceneView held(std::uint32_t part) const { return opened(parts.scene_of(part)); }
  [[nodiscard]] SceneView pair(std::uint32_t part, std::uint32_t driven = 0) const {
    return opened(parts.pair_scene(part, parts.driven()[driven].part));
  }
  [[nodiscard]] std::vector<std::uint32_t> others(std::uint32_t part) const {
    return {parts.others_of(part).begin(), parts.others_of(part).end()};
  }

  CompiledScene compiled;
  SceneBytes blob;
  SceneView view;
  PartScenes parts;

 private:
  static SceneView opened(std::span<const std::byte> bytes) {
    SceneView inside;
    REQUIRE(SceneView::open(bytes, inside) == RtStatus::kOk);
    return inside;
  }
};

std::string refusal_of(const std::string& text) {
  try {
    static_cast<void>(compile_scene(parse_scene_file(text, "parts.toml", "."), {}));
    return "";
  } catch (const InputError& error) {
    return error.what();
  }
}

std::string body_name_in(const SceneView& scene, std::size_t body) {
  const BodyRecord& record = scene.bodies()[body];
  return std::string(scene.text(record.name_offset, record.name_bytes));
}

void check_near(const double* found, std::initializer_list<double> wanted) {
  for (const double x : wanted) CHECK(std::abs(*found++ - x) < 1e-12);
}

using Others = std::vector<std::uint32_t>;

}  // namespace

TEST_SUITE("tools.driven_parts") {
  TEST_CASE("a driven part has a record with its speeds, its push and its size") {
    const Pushed scene(pushed_parts());
    REQUIRE(scene.parts.count() == 4);
    CHECK(scene.parts[2].role == PartRole::kDriven);
    CHECK(!scene.parts.may_be_held(2));
    CHECK(scene.parts[2].law_bytes == 0);
    CHECK(scene.parts[1].law_bytes == 0);
    CHECK(scene.parts[0].law_bytes > 0);
    CHECK(scene.parts[3].law_bytes > 0);
    REQUIRE(scene.parts.driven().size() == 1);
    const DrivenRecord& driven = scene.parts.driven()[0];
    CHECK(driven.part == 2);
    CHECK(driven.fastest_m_per_s == 0.25);
    CHECK(driven.fastest_rad_per_s == 2);
    CHECK(driven.late_s == 0.1);
    CHECK(driven.push_n == 100);
    CHECK(driven.ratio == kDrivenRatio);
    check_near(driven.middle_m, {0, 0, 0});
    const double radius_m = std::hypot(0.015, 0.02, 0.01);
    CHECK(driven.radius_m >= radius_m);
    CHECK(driven.radius_m < radius_m * (HAPTIC_REAL_IS_FLOAT ? 1 + 1e-5 : 1 + 1e-12));
  }

  TEST_CASE("in the scene of a pair the driven part stands at its mesh frame, the held one moves") {
    const Pushed scene(pushed_parts() +
                       "[[friction]]\nmaterials = [\"steel\", \"pom\"]\nmu = 0.2\n");
    const SceneView peg = scene.pair(0), ring = scene.pair(3);
    for (const SceneView& pair : {peg, ring}) {
      REQUIRE(pair.bodies().size() == 2);
      CHECK(body_name_in(pair, 1) == "pusher");
      check_near(pair.bodies()[1].reference_m, {0, 0, 0});
      // Its box has the sides of the shape, not those of the turned one.
      double half_m[3] = {0, 0, 0};
      const PieceView box = pair.piece(pair.bodies()[1].piece_begin);
      for (std::uint32_t v = 0; v < box.record->vertex_count; ++v)
        for (std::size_t k = 0; k < 3; ++k)
          half_m[k] = std::max(half_m[k], std::abs(static_cast<double>(box.vertices[3 * v + k])));
      for (std::size_t k = 0; k < 3; ++k)
        CHECK(half_m[k] == doctest::Approx(0.5 * (k == 0 ? 0.03 : k == 1 ? 0.04 : 0.02)));
    }
    CHECK(body_name_in(peg, 0) == "peg");
    CHECK(body_name_in(ring, 0) == "ring");
    const double half = std::sqrt(0.5);
    check_near(peg.parameters().start_p_wa_m, {-0.02, 0.1, 0.01});
    check_near(peg.parameters().start_q_wa_xyzw, {0, 0, -half, half});
    check_near(ring.parameters().start_p_wa_m, {-0.02, 0.06, -0.04699});
    CHECK(peg.bodies()[1].friction == 0.2);
    CHECK(ring.bodies()[1].friction == 0);
    // The hand's spring is that of the scene in which the part is held.
    const CouplingParameters &k = peg.parameters().coupling,
                             &held = scene.held(0).parameters().coupling;
    CHECK(k.k_t_n_per_m == held.k_t_n_per_m);
    CHECK(k.k_r_nm_per_rad == held.k_r_nm_per_rad);
    // Nothing else makes a pair.
    CHECK(scene.parts.pair_scene(1, 2).empty());
    CHECK(scene.parts.pair_scene(2, 0).empty());
    CHECK(scene.parts.pair_scene(0, 1).empty());
    CHECK(scene.parts.pair_scene(0, 3).empty());
  }

  TEST_CASE("a part is held in a scene without the driven ones") {
    const Pushed scene(pushed_parts());
    CHECK(scene.view.bodies().size() == 4);
    CHECK(scene.others(0) == Others{1, 3});
    CHECK(scene.others(3) == Others{0, 1});
    CHECK(scene.held(0).bodies().size() == 3);
    CHECK(body_name_in(scene.held(0), 1) == "table");
    CHECK(body_name_in(scene.held(0), 2) == "ring");
  }

  TEST_CASE("each part that may be held states the memory that its law takes") {
    const Pushed scene(pushed_parts());
    for (const std::uint32_t part : {0u, 3u}) {
      const SceneView held_scene = scene.held(part);
      PartsInHands held;
      held.part[0] = part;
      held.scene[0] = &held_scene;
      DrivenParts movers;
      const Pose start = pose_of(scene.parts.start_of(2));
      movers.begin(scene.parts.driven(), std::span(&start, 1));
      SceneBytes memory(scene.parts[part].law_bytes);
      const std::span<std::byte> all = memory.span();
      JointMotion* motion = nullptr;
      CHECK(scene.parts.meets_standing(part));
      CHECK(JointMotion::create(all, scene.parts, held, movers, motion) == RtStatus::kOk);
      CHECK(motion != nullptr);
      // To the last cache line.
      const auto less = all.first(all.size() - kLawAlignment);
      CHECK(JointMotion::create(less, scene.parts, held, movers, motion) ==
            RtStatus::kMemoryTooSmall);
      CHECK(motion == nullptr);
    }
  }

  TEST_CASE("parts that never meet have no scene of the two") {
    const Pushed scene(pushed_parts() + "[bodies]\nnever = [[\"ring\", \"pusher\"]]\n");
    CHECK(scene.parts.pair_scene(3, 2).empty());
    CHECK(!scene.parts.pair_scene(0, 2).empty());
    CHECK(scene.others(3) == Others{0, 1});
    CHECK(scene.parts[3].law_bytes > 0);
    const Pushed none(pushed_parts() +
                      "[bodies]\nnever = [[\"ring\", \"pusher\"], [\"peg\", \"pusher\"]]\n");
    REQUIRE(none.parts.driven().size() == 1);
    CHECK(none.parts.pair_scene(0, 2).empty());
  }

  TEST_CASE("where a part meets driven ones alone, these stand in its scene") {
    const Pushed alone(std::string(kPushedHead) + kPushedPeg + kPusher);
    CHECK(alone.others(0) == Others{1});
    CHECK(alone.held(0).bodies().size() == 2);
    CHECK(alone.pair(0).bodies().size() == 2);
    // In W there, at its mesh frame here.
    check_near(alone.held(0).parameters().start_p_wa_m, {0, 0, 0.06});
    check_near(alone.pair(0).parameters().start_p_wa_m, {-0.02, 0.1, 0.01});
    const Pushed ring(pushed_parts() +
                      "[bodies]\nnever = [[\"ring\", \"peg\"], [\"ring\", \"table\"]]\n");
    CHECK(ring.others(3) == Others{2});
    CHECK(ring.others(0) == Others{1});
    CHECK(body_name_in(ring.held(3), 1) == "pusher");
    CHECK(ring.parts[3].law_bytes > 0);
  }

  TEST_CASE("the middle of a driven part is that of its box, wherever its mesh frame is") {
    const sim::test::ScratchFolder folder("driven_parts");
    haptic::test::write_cube(folder.file("cube.obj"), 3);
    const char* pushers[] = {"", "as = \"surface\"\n"};
    for (const char* as : pushers) {
      const Pushed scene(std::string(kPushedHead) + kPushedTable + kPushedPeg +
                             "[[part]]\nname = \"cube\"\nrole = \"driven\"\nmesh = \"cube.obj\"\n"
                             "scale_to_m = 0.01\nposition_m = [0.1, 0, 0]\nfastest_m_per_s = 1\n"
                             "fastest_rad_per_s = 1\n" +
                             as,
                         folder.file(""));
      REQUIRE(scene.parts.driven().size() == 1);
      const DrivenRecord& driven = scene.parts.driven()[0];
      check_near(driven.middle_m, {0.035, 0.035, 0.035});
      CHECK(driven.radius_m == doctest::Approx(0.005 * std::sqrt(3.0)));
      check_near(scene.pair(0).parameters().start_p_wa_m, {-0.1, 0, 0.06});
    }
  }

  TEST_CASE("the push is ten times the pull of the hand's spring, or as the scene says") {
    const std::string device = "[device]\nmax_force_n = 8\n";
    CHECK(Pushed(pushed_parts() + device).parts.driven()[0].push_n == 80);
    const std::string given =
        with_line(pushed_parts(), "fastest_rad_per_s = 2", "fastest_rad_per_s = 2\npush_n = 12");
    CHECK(Pushed(given + device).parts.driven()[0].push_n == 12);
    CHECK(Pushed(given).parts.driven()[0].push_n == 12);
    const std::string weak = with_line(given, "push_n = 12", "push_n = 8") + device;
    CHECK(refusal_of(weak) ==
          "parts.toml:30:10: [[part]] push_n: is 8 N, and the hand's spring pulls with up to 8 N "
          "([device] max_force_n), so that the hand would push 'pusher' back; give more than "
          "that, or leave it out for 80 N");
  }

  TEST_CASE("changed scenes keep the driven parts and change the scenes of pairs") {
    const Pushed scene(pushed_parts());
    const SceneBytes bytes = with_changed(scene.view, [](const SceneView& of) {
      return changed_scene(of, [](SceneParameters& p) { p.coupling.passes = 5; });
    });
    SceneView view;
    PartScenes parts;
    REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
    REQUIRE(PartScenes::open(view, parts) == RtStatus::kOk);
    REQUIRE(parts.driven().size() == 1);
    CHECK(parts.driven()[0].push_n == 100);
    CHECK(parts.most_law_bytes() > 0);
    for (const std::uint32_t part : {0u, 3u}) {
      SceneView pair;
      REQUIRE(SceneView::open(parts.pair_scene(part, 2), pair) == RtStatus::kOk);
      CHECK(pair.parameters().coupling.passes == 5);
    }
    const SceneBytes same =
        with_changed(scene.view, [](const SceneView& of) { return SceneBytes(of.blob()); });
    CHECK(std::ranges::equal(same.span(), scene.blob.span()));
  }

  TEST_CASE("a scene without driven parts has no table of them") {
    const Pushed scene(std::string(kPushedHead) + kPushedTable + kPushedPeg + kPushedRing);
    CHECK(scene.parts.driven().empty());
    CHECK(scene.parts[0].law_bytes == 0);
    CHECK(scene.parts.most_law_bytes() == 0);
    for (const SectionEntry& s : scene.view.sections()) {
      CHECK(s.id != SectionId::kDriven);
      CHECK(s.id != SectionId::kBodyPairs);
    }
  }

  TEST_CASE(
      "two hands: each is held without the other, and the smaller part meets the larger one") {
    const std::string second =
        "[[part]]\nname = \"block\"\nrole = \"hand2\"\nshape = \"box\"\nsize_m = [0.2, 0.2, 0.02]\n"
        "position_m = [0, 0, -0.3]\n";
    const Pushed scene(std::string(kPushedHead) + kPushedTable + second + kPusher + kPushedPeg);
    REQUIRE(scene.parts.count() == 4);
    CHECK(scene.parts.hands() == 2);
    CHECK(scene.parts.name(0) == "peg");
    CHECK(scene.parts.name(1) == "block");
    CHECK(scene.parts[1].role == PartRole::kHand2);
    CHECK(scene.parts.may_be_held(1));
    CHECK(!scene.parts.may_be_taken(1));
    CHECK(!scene.parts.may_be_taken(0));
    // Parts 2 and 3: the table and the pusher.
    CHECK(scene.others(0) == Others{2});
    CHECK(scene.others(1) == Others{2});
    CHECK(scene.parts.meets_standing(1));
    CHECK(!scene.parts.pair_scene(0, 1).empty());
    CHECK(scene.parts.pair_scene(1, 0).empty());
    CHECK(!scene.parts.pair_scene(0, 3).empty());
    CHECK(!scene.parts.pair_scene(1, 3).empty());
    CHECK(scene.parts[0].law_bytes > 0);
    CHECK(scene.parts[1].law_bytes == 0);
    // Nothing stands: each is in the scene of the other.
    const Pushed alone(std::string(kPushedHead) + second + kPushedPeg);
    CHECK(alone.others(0) == Others{1});
    CHECK(alone.others(1) == Others{0});
    CHECK(!alone.parts.meets_standing(0));
    CHECK(!alone.parts.meets_standing(1));
    const Pushed never(std::string(kPushedHead) + kPushedTable + second + kPushedPeg +
                       "[bodies]\nnever = [[\"peg\", \"block\"]]\n");
    CHECK(never.parts.pair_scene(0, 1).empty());
  }

  TEST_CASE("a start inside a driven part is warned of between solids, and refused of a surface") {
    const std::string inside =
        with_line(pushed_parts(), "position_m = [0.1, 0.02, 0.05]", "position_m = [0.04, 0, 0]");
    // Solids: a warning, with the place in W.
    const Pushed warned(inside);
    const auto has_warning = [&](std::size_t part) {
      return std::ranges::any_of(warned.compiled.parts[part].warnings, [](const std::string& text) {
        return haptic::test::has(text, "start pose lies inside box");
      });
    };
    CHECK(has_warning(3));
    CHECK(!has_warning(0));
    const std::string refused = refusal_of(
        with_line(inside, "name = \"pusher\"\n", "name = \"pusher\"\nas = \"surface\"\n"));
    CAPTURE(refused);
    CHECK(haptic::test::has(refused, "parts.toml: tube: the start pose lies inside box"));
    const std::string hand = with_line(
        with_line(pushed_parts(), "position_m = [0.1, 0.02, 0.05]", "position_m = [0, 0, 0.06]"),
        "name = \"pusher\"\n", "name = \"pusher\"\nas = \"surface\"\n");
    CHECK(haptic::test::has(refusal_of(hand), "parts.toml: cylinder: the start pose meets face"));
  }

  TEST_CASE("the compiler and the facts of a scene name the driven parts") {
    const Pushed scene(pushed_parts());
    const std::string summary = summary_as_text(scene.compiled, "x");
    CAPTURE(summary);
    CHECK(haptic::test::has(summary,
                            "driven       pusher: at up to 0.25 m/s and 2 rad/s, late after 0.1 s, "
                            "pushes with up to 100 N; 2 scenes with parts that may be held, "));
    CHECK(haptic::test::has(report_as_text(scene.compiled), "driven       pusher: at up to"));
    const std::string facts = facts_as_text(facts_of(scene.view));
    CHECK(haptic::test::has(facts, "driven 'pusher': 1 pieces"));
    CHECK(haptic::test::has(facts, "moved by its owner: at up to 0.25 m/s"));
    const auto json = facts_as_json(facts_of(scene.view));
    CHECK(json["parts"][2]["role"] == "driven");
    CHECK(json["parts"][2]["driven"]["scenes"] == 2);
    CHECK(json["parts"][1]["driven"].is_null());
  }

  TEST_CASE("what a driven part cannot have is refused with its place") {
    const std::string good = pushed_parts();
    std::string eight = good;
    for (int k = 0; k < 7; ++k) {
      const std::string number = std::to_string(k);
      eight += with_line(with_line(kPusher, "\"pusher\"", "\"pusher_" + number + "\""),
                         "[0.1, 0.02, 0.05]", "[0.1, 0.02, 0." + number + "9]");
    }
    const auto with_key = [&](const char* name, const std::string& key) {
      const std::string line = std::string("name = \"") + name + "\"\n";
      return with_line(good, line, line + key + "\n");
    };
    const std::pair<std::string, const char*> bad[] = {
        {with_line(good, "fastest_m_per_s = 0.25\n", ""),
         "[[part]] fastest_m_per_s is missing; give the largest speed at which the part moves"},
        {with_line(good, "fastest_rad_per_s = 2\n", ""),
         "[[part]] fastest_rad_per_s is missing; give the largest speed at which the part turns"},
        {with_line(good, "fastest_m_per_s = 0.25", "fastest_m_per_s = 0"), "give a number above 0"},
        {with_line(good, "fastest_rad_per_s = 2", "fastest_rad_per_s = -1"),
         "give a number above 0"},
        {with_key("pusher", "late_s = 0.6"), "late_s is 0.6; give a number"},
        {with_key("pusher", "late_s = 0"), "late_s is 0; give a number"},
        {with_key("pusher", "push_n = 0"), "push_n is 0; give a number above 0"},
        {with_key("pusher", "grip_m = [0, 0, 0]"), "is of a part that the hand may hold; leave"},
        {with_key("pusher", "mass_kg = 1"), "is of a part that the hand may hold; leave it out"},
        {with_key("peg", "push_n = 10"),
         "push_n: is of a part with role = \"driven\"; leave it out"},
        {with_key("ring", "fastest_m_per_s = 10"), "is of a part with role = \"driven\""},
        {with_key("table", "late_s = 0.1"), "is of a part with role = \"driven\"; leave it out"},
        {with_line(good, "role = \"driven\"", "role = \"drive\""),
         "\"driven\" for one that its owner moves"},
        {eight,
         "has 9 parts in hands or driven, which move all the time; give at most 8: make one"}};
    for (const auto& [text, words] : bad) {
      const std::string message = refusal_of(text);
      CAPTURE(message);
      CHECK(haptic::test::has(message, "parts.toml:"));
      CHECK(haptic::test::has(message, words));
    }
    CHECK(refusal_of(good) == "");
  }
}
