// SPDX-License-Identifier: Apache-2.0
// Scene files with [[part]] tables, from the text to the hand: a peg goes into a socket, is let go,
// and a ring is put over it.
#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "rt_core/part_hand.hpp"
#include "tests/support/text_search.hpp"
#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/report.hpp"
#include "tools/graph_compiler/program/traits_header.hpp"

using namespace haptic;
using namespace haptic::tools;

namespace {

constexpr const char* kHead =
    "format = 1\nname = \"assembly\"\n"
    "[rendering]\nk_f_n_per_m = 800\n";
constexpr const char* kTable =
    "[[part]]\nname = \"table\"\nrole = \"fixed\"\nshape = \"box\"\nsize_m = [0.2, 0.2, 0.02]\n"
    "position_m = [0, 0, -0.01]\nmaterial = \"steel\"\n";
constexpr const char* kSocket =
    "[[part]]\nname = \"socket\"\nrole = \"fixed\"\nshape = \"tube\"\nsegments = 16\n"
    "inner_radius_m = 0.0052\nouter_radius_m = 0.01\nheight_m = 0.02\nposition_m = [0, 0, 0.01]\n";
constexpr const char* kPeg =
    "[[part]]\nname = \"peg\"\nrole = \"hand\"\nshape = \"cylinder\"\nsegments = 16\n"
    "radius_m = 0.005\nheight_m = 0.04\nposition_m = [0, 0, 0.06]\n";
constexpr const char* kRing =
    "[[part]]\nname = \"ring\"\nrole = \"placed\"\nshape = \"tube\"\nsegments = 16\n"
    "inner_radius_m = 0.0055\nouter_radius_m = 0.009\nheight_m = 0.006\n"
    "position_m = [0.04, 0, 0.00301]\n";

std::string all_parts() {
  std::string text(kHead);
  for (const char* part : {kTable, kSocket, kPeg, kRing}) text.append(part);
  return text;
}

std::string message_of(const std::string& text) {
  try {
    static_cast<void>(parse_scene_file(text, "parts.toml", "."));
    return "";
  } catch (const InputError& error) {
    return error.what();
  }
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

/// The scene of a text with a hand over it; the device stands where the first part starts.
struct Bench {
  explicit Bench(const std::string& text)
      : blob(compile_scene(parse_scene_file(text, "parts.toml", "."), {}).bytes) {
    REQUIRE(SceneView::open(blob.span(), view) == RtStatus::kOk);
    REQUIRE(PartScenes::open(view, parts) == RtStatus::kOk);
    for (int k = 0; k < 2; ++k) {
      scene[k] = SceneBytes(parts.most_bytes());
      state[k] = SceneBytes(parts.most_state_bytes());
    }
    REQUIRE(hand.begin(parts, {scene[0].span(), state[0].span(), {}},
                       {scene[1].span(), state[1].span(), {}}) == RtStatus::kOk);
    for (int k = 0; k < 3; ++k) device[k] = parts.start_of(0).p_wa_m[k];
    step();
  }

  void step() {
    StepInput input;
    for (int k = 0; k < 3; ++k) input.pose_wa.p_wa[k] = static_cast<Real>(device[k]);
    const StepResult result = hand.step(input);
    const Vec3 change_n = result.wrench_w.force_w - last.wrench_w.force_w;
    largest_step_n = std::max(largest_step_n, static_cast<double>(change_n.norm()));
    least_gap_m = std::min(least_gap_m, static_cast<double>(result.proxy_gap_m));
    last = result;
  }
  void go(double x, double y, double z, int ticks) {
    const double from[3] = {device[0], device[1], device[2]}, way[3] = {x, y, z};
    for (int k = 1; k <= ticks; ++k) {
      for (int i = 0; i < 3; ++i) device[i] = from[i] + way[i] * k / ticks;
      step();
    }
  }
  void let_go() {
    hand.release();
    for (int k = 0; k < 500 && hand.phase() != PartHand::Phase::kEmpty; ++k) step();
    REQUIRE(hand.phase() == PartHand::Phase::kEmpty);
  }
  void take(std::uint32_t part) {
    REQUIRE(hand.prepare(part) == RtStatus::kOk);
    step();
    REQUIRE(hand.part() == part);
  }
  [[nodiscard]] double felt(int k) const { return static_cast<double>(last.proxy_pose_wa.p_wa[k]); }

  SceneBytes blob, scene[2], state[2];
  SceneView view;
  PartScenes parts;
  PartHand hand;
  double device[3] = {0, 0, 0};
  StepResult last;
  double largest_step_n = 0, least_gap_m = 0;
};

void assemble(const std::string& text) {
  Bench bench(text);
  REQUIRE(bench.parts.count() == 4);
  CHECK(bench.parts.name(0) == "peg");
  CHECK(bench.parts.name(3) == "ring");
  // Into the socket and 3 mm into the table, then let go: it stands on the table.
  bench.go(0.0001, 0, -0.043, 900);
  CHECK(static_cast<double>(bench.last.wrench_w.force_w.z()) > 1);
  CHECK(bench.felt(2) == doctest::Approx(0.02).epsilon(1e-4));
  bench.let_go();
  CHECK(bench.hand.places()[0].p_wa_m[2] == doctest::Approx(0.02).epsilon(1e-4));
  bench.go(0.01, 0.01, 0.05, 50);
  CHECK(bench.last.wrench_w.force_w.norm() == 0);

  // The ring: up, over the peg, down as far as it goes: onto the socket.
  bench.largest_step_n = 0;
  bench.take(3);
  for (int k = 0; k < 200; ++k) bench.step();
  CHECK(bench.largest_step_n == 0);
  bench.go(0, 0, 0.05, 300);
  CHECK(bench.felt(2) == doctest::Approx(0.05301).epsilon(1e-4));
  bench.go(-0.04, 0, 0, 300);
  bench.go(0, 0, -0.035, 700);
  CHECK(static_cast<double>(bench.last.wrench_w.force_w.z()) > 1);
  CHECK(bench.felt(2) == doctest::Approx(0.02 + 0.003).epsilon(1e-3));
  // Held to the peg: aside it goes by the clearance.
  bench.go(0.01, 0, 0.0015, 200);
  CHECK(std::abs(bench.felt(0)) < 0.001);
  CHECK(static_cast<double>(bench.last.wrench_w.force_w.x()) < -1);
  bench.let_go();
  CHECK(bench.least_gap_m > -2e-6);
}

}  // namespace

TEST_SUITE("tools.held_parts") {
  TEST_CASE("a peg is put into a socket, let go, and a ring is put over it") {
    assemble(all_parts());
  }

  TEST_CASE("so it is where the ring and the socket are surfaces") {
    const std::string text =
        replaced(all_parts(), "name = \"ring\"\n", "name = \"ring\"\nas = \"surface\"\n");
    assemble(replaced(text, "name = \"socket\"\n", "name = \"socket\"\nas = \"surface\"\n"));
  }

  TEST_CASE("a scene file of parts: the hand's first, the others in their order") {
    const SceneFile scene = parse_scene_file(all_parts(), "parts.toml", ".");
    CHECK(scene.has_parts());
    CHECK(scene.moving.name == "peg");
    REQUIRE(scene.statics.size() == 3);
    CHECK(scene.statics[2].role == PartRole::kPlaced);
    const SceneFile ring = scene_holding(scene, 3, parts_standing(scene, 3));
    CHECK(ring.moving.name == "ring");
    CHECK(ring.statics[0].name == "peg");
    CHECK(ring.statics[1].name == "table");
    CHECK(ring.statics[2].name == "socket");
  }

  TEST_CASE("parts that never meet are not compiled, and pass through each other") {
    const std::string text = all_parts() + "[bodies]\nnever = [[\"ring\", \"socket\"]]\n";
    const SceneFile scene = parse_scene_file(text, "parts.toml", ".");
    CHECK(parts_met(scene, 3) == std::vector<std::size_t>{0, 1});
    CHECK(parts_met(scene, 0) == std::vector<std::size_t>{1, 2, 3});
    const Bench all(all_parts()), fewer(text);
    CHECK(fewer.blob.span().size() < all.blob.span().size());
    PartScenes parts;
    REQUIRE(PartScenes::open(fewer.view, parts) == RtStatus::kOk);
    REQUIRE(parts.others_of(3).size() == 2);
    CHECK(parts.others_of(3)[1] == 1);
    CHECK(parts.others_of(0).size() == 3);
    // So it is for the part that is held at first: the scene around is against all.
    const Bench peg(all_parts() + "[bodies]\nnever = [[\"socket\", \"peg\"]]\n");
    REQUIRE(PartScenes::open(peg.view, parts) == RtStatus::kOk);
    CHECK(parts.others_of(0).size() == 2);
    CHECK(peg.view.bodies().size() == 4);
  }

  TEST_CASE("the compiler says which parts the hand may hold") {
    const CompiledScene compiled =
        compile_scene(parse_scene_file(all_parts(), "parts.toml", "."), {});
    CHECK(haptic::test::has(summary_as_text(compiled, "x"),
                            "one after another, 2 parts: peg, ring\n"));
  }

  TEST_CASE("no image is made of a scene whose parts the hand may hold") {
    const Bench bench(all_parts());
    CHECK_THROWS_WITH_AS(
        static_cast<void>(image_traits(bench.view, {}, {})),
        "an image has one moving part, and the hand may hold several of this scene; leave out "
        "--traits, or write the parts as [moving] and [[static]]",
        InputError);
  }

  TEST_CASE("what a scene of parts cannot say is refused with its place") {
    const std::string good = all_parts();
    const std::pair<std::string, const char*> bad[] = {
        {replaced(good, "role = \"hand\"", "role = \"fixed\""), "none has role = \"hand\""},
        {replaced(good, "role = \"placed\"", "role = \"hand\""), "another part already"},
        {replaced(good, "role = \"placed\"", "role = \"lose\""), "is 'lose'; give \"hand\""},
        {replaced(good, "role = \"placed\"\n", ""),
         "give \"hand\", \"hand2\", \"placed\", \"fixed\", \"driven\" or \"loose\""},
        {replaced(good, "name = \"ring\"", "name = \"peg\""), "is the name of another part"},
        {replaced(good, "name = \"ring\"\n", ""), "give the part a name"},
        {replaced(good, "name = \"table\"\n", "name = \"table\"\ngrip_m = [0, 0, 0]\n"),
         "is of a part that the hand may hold"},
        {good + "[moving]\nshape = \"box\"\nsize_m = [1, 1, 1]\n", "[[part]] is given too"},
        {std::string(kHead) + kPeg, "is one alone"},
        {good + "[motion_limits]\norientation = { about = \"start\", max_angle_rad = 0.5 }\n",
         "are of one moving part"},
        {replaced(good, "k_f_n_per_m = 800", "k_f_n_per_m = 800\nlaw = \"paper\""),
         "asks for law = \"proxy\""},
        {good + "[bodies]\nnever = [[\"ring\", \"nut\"]]\n", "no part has that name"},
        {good + "[bodies]\nnever = [[\"ring\", \"ring\"]]\n", "twice in one pair"},
        {good + "[bodies]\nnever = [[\"ring\"]]\n", "has 1 elements"},
        {good + "[bodies]\nnever = [\"ring\"]\n", "give an array of two strings"},
        {good + "[bodies]\nnever = [[\"ring\", \"peg\"], [\"ring\", \"table\"], "
                "[\"ring\", \"socket\"]]\n",
         "leaves 'ring' nothing to meet"},
        {good + "[[friction]]\nmaterials = [\"steel\", \"pom\"]\nmu = 0.1\n",
         "no part is of 'pom'"}};
    for (const auto& [text, words] : bad) {
      const std::string message = message_of(text);
      CAPTURE(message);
      CHECK(haptic::test::has(message, "parts.toml:"));
      CHECK(haptic::test::has(message, words));
    }
    CHECK(message_of(good) == "");
  }
}
