// SPDX-License-Identifier: Apache-2.0
// Notes on fixed parts whose faces are almost in one plane.
#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tools/common/formatted.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/flush_faces.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"

using namespace haptic;
using namespace haptic::tools;

namespace {

std::string block(double x_m, double top_m, const std::string& more = "") {
  // 20 mm wide and 10 mm high, its origin in the middle.
  return "[[static]]\nshape = \"box\"\nsize_m = [0.02, 0.02, 0.01]\n" +
         formatted("position_m = [%.17g, 0, %.17g]\n", x_m, top_m - 0.005) + more;
}

CompiledScene compiled(const std::string& statics, const std::string& more = "") {
  const std::string text =
      "format = 1\nname = \"flush\"\n[moving]\nshape = \"box\"\nsize_m = [0.012, 0.012, 0.012]\n"
      "position_m = [0, 0, 0.05]\n" +
      statics + "[rendering]\nk_f_n_per_m = 800\n" + more;
  return compile_scene(parse_scene_file(text, "flush.toml", "."), {});
}

std::vector<FlushStep> steps_of(const std::string& statics, double least_m, double most_m) {
  const SceneBytes bytes{compiled(statics).bytes};
  SceneView view;
  REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
  return flush_steps(view, {}, least_m, most_m);
}

}  // namespace

TEST_SUITE("tools.flush_faces") {
  TEST_CASE(
      "a step between two blocks is found with its height and place, within the heights asked") {
    for (const double height : {5e-8, 1e-6, 3e-5, 9e-5}) {
      CAPTURE(height);
      const auto steps = steps_of(block(-0.01, 0) + block(0.01, height), 1e-8, 1e-4);
      REQUIRE(steps.size() == 1);
      CHECK(steps[0].body == 1);
      CHECK(steps[0].other == 2);
      CHECK(steps[0].height_m == doctest::Approx(height).epsilon(1e-6));
      CHECK(std::abs(steps[0].place_m[0]) < 1e-9);
    }
    // The probes: in one plane to the tolerance; a step that everybody sees; faces far apart.
    CHECK(steps_of(block(-0.01, 0) + block(0.01, 5e-9), 1e-8, 1e-4).empty());
    CHECK(steps_of(block(-0.01, 0) + block(0.01, 2e-4), 1e-8, 1e-4).empty());
    CHECK(steps_of(block(-0.02, 0) + block(0.02, 1e-6), 1e-8, 1e-4).empty());
  }

  TEST_CASE("blocks turned by a rounded angle are highest apart at the end of their seam") {
    // Turned about x by 1e-5 rad: 1e-7 m at 10 mm.
    const std::string turned = "quaternion = { w = 0.9999999999875, x = 5e-6, y = 0.0, z = 0.0 }\n";
    const auto steps = steps_of(block(-0.01, 0) + block(0.01, 0, turned), 1e-8, 1e-4);
    REQUIRE(steps.size() == 1);
    CHECK(steps[0].height_m == doctest::Approx(1e-7).epsilon(0.02));
    CHECK(std::abs(steps[0].place_m[1]) == doctest::Approx(0.01).epsilon(1e-3));
  }

  TEST_CASE("one step for every two parts, and none within a part") {
    const auto steps = steps_of(block(-0.02, 0) + block(0, 1e-6) + block(0.02, 3e-6), 1e-8, 1e-4);
    REQUIRE(steps.size() == 2);
    CHECK(steps[0].height_m == doctest::Approx(1e-6).epsilon(1e-6));
    CHECK(steps[1].height_m == doctest::Approx(2e-6).epsilon(1e-6));
    CHECK(steps[1].body == 2);
  }

  TEST_CASE("the note says whether the step is climbed, and where it is") {
    const FlushStep step{1, 2, 7.3e-8, {0.01, 0, 0.02}};
    const std::string low = flush_step_text(step, "a.stl", "b.stl", 5e-6);
    CHECK(low.find("[[static]] 1 (a.stl) and 2 (b.stl)") != std::string::npos);
    CHECK(low.find("7.3e-08 m near (0.01, 0, 0.02) m: climbed") != std::string::npos);
    CHECK(flush_step_text(step, "a", "b", 5e-8).find("a real step") != std::string::npos);
    CHECK(flush_step_text(step, "a", "b", 0).find("a real step") != std::string::npos);
  }
}
