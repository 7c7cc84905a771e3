// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>

#include "tests/support/shapes.hpp"
#include "tests/tools/compiler/part_scenes.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/report.hpp"

using namespace haptic;
using namespace haptic::test;
using haptic::sim::test::ScratchFolder;
using tools::SteadyWork;

namespace {

SteadyWork work_at(double linear_m_per_s, double angular_rad_per_s) {
  tools::SceneDescription scene = scene_of(random_hull(9, 24, {0.03, 0.02, 0.04}),
                                           {box({0, 0, 0}, {0.2, 0.2, 0.2}), prism(9, 0.1, 0.1)});
  scene.parameters.motion_limits_given = 1;
  scene.parameters.max_linear_speed_m_per_s = linear_m_per_s;
  scene.parameters.max_angular_speed_rad_per_s = angular_rad_per_s;
  const LoadedScene loaded(scene);
  const std::optional<SteadyWork> work = tools::steady_work(loaded.view);
  REQUIRE(work.has_value());
  return *work;
}

/// A cube of the given size [m] against a large one.
tools::CompiledScene cube_scene(const std::string& scale_to_m, double epsilon_m,
                                const std::string& rendering) {
  const ScratchFolder folder("steady");
  write_cube(folder.file("cube.obj"));
  std::ofstream(folder.file("scene.toml"))
      << "format = 1\nname = \"w\"\n[moving]\nmesh = \"cube.obj\"\nscale_to_m = " << scale_to_m
      << "\n[[static]]\nmesh = \"cube.obj\"\nscale_to_m = 0.3\n[rendering]\nk_f_n_per_m = 100\n"
      << "epsilon_m = " << epsilon_m << "\n"
      << rendering;
  return tools::compile_scene(tools::read_scene_file(folder.file("scene.toml")), {});
}

std::vector<std::string> warnings_for(const std::string& scale_to_m, double epsilon_m) {
  return tools::epsilon_warnings(cube_scene(scale_to_m, epsilon_m, ""));
}

}  // namespace

TEST_SUITE("tools.steady_work") {
  TEST_CASE("no motion limits, no certificate") {
    const LoadedScene scene(scene_of(box({0, 0, 0}, {1, 1, 1}), {box({2, 0, 0}, {3, 1, 1})}));
    CHECK(!tools::steady_work(scene.view).has_value());
  }

  TEST_CASE("the figures repeat, grow with the speed and never pass the count of all features") {
    const SteadyWork slow = work_at(0.01, 0.1), slow_again = work_at(0.01, 0.1);
    const SteadyWork fast = work_at(1.0, 10.0), wild = work_at(1e4, 1e4);
    REQUIRE(slow.pairs.size() == 2);
    CHECK(slow.seed == fast.seed);
    for (std::size_t i = 0; i < 2; ++i) {
      CAPTURE(slow.seed);
      const tools::PairSteadyWork &s = slow.pairs[i], &f = fast.pairs[i], &w = wild.pairs[i];
      CHECK(s.median == slow_again.pairs[i].median);
      CHECK(s.largest == slow_again.pairs[i].largest);
      CHECK(s.renewed_median == slow_again.pairs[i].renewed_median);
      CHECK(s.median <= s.largest);
      CHECK(s.largest <= f.largest);
      CHECK(s.median < f.median);
      CHECK(s.renewed_median < f.renewed_median);
      CHECK(f.largest <= f.features);
      CHECK(w.median == w.features);
      CHECK(w.renewed_median == doctest::Approx(w.features));
      // In contact something carries it: at least two features on a vertex or a face.
      CHECK(s.median >= 1);
    }
    // Hull of 24: 44 faces, 66 edges; box: 6 and 12.
    CHECK(slow.pairs[0].features == 44 + 66 + 6 + 12);
    CHECK(slow.pairs[0].age_ticks == 8);
  }

  TEST_CASE("epsilon is held against the features of a part") {
    CHECK(warnings_for("[0.1, 0.1, 0.1]", 1e-4).empty());
    CHECK(warnings_for("[0.1, 0.1, 0.001]", 1e-4).empty());
    const std::vector<std::string> thin = warnings_for("[0.1, 0.1, 0.00005]", 1e-4);
    REQUIRE(thin.size() == 2);
    CHECK(thin[0].find("cube.obj: epsilon_m 0.1 mm exceeds the width of face") == 0);
    CHECK(thin[0].find("of piece 0, 0.05 mm; the tracker stays exact but is slower; fix: "
                       "epsilon_m below 0.025 mm") != std::string::npos);
    CHECK(thin[1].find("the height of vertex") != std::string::npos);
  }

  TEST_CASE("epsilon is warned of where near sets are formed, and nowhere else") {
    const auto told = [](const std::string& rendering) {
      const auto all = tools::warnings_of(cube_scene("[0.1, 0.1, 0.00005]", 1e-4, rendering));
      return std::ranges::count_if(all, [](const std::string& warning) {
        return warning.find("epsilon_m") != std::string::npos;
      });
    };
    CHECK(told("") == 0);
    CHECK(told("law = \"proxy\"\n") == 0);
    CHECK(told("goal_contact = true\n") == 2);
    CHECK(told("law = \"paper\"\n") == 2);
  }
}
