// SPDX-License-Identifier: Apache-2.0
// Exit codes by the verdict, as a user meets them: a scene for each that provokes it, and many
// right ones that do not.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/program_run.hpp"
#include "tools/common/formatted.hpp"
#include "tools/common/split_mix.hpp"

using haptic::sim::test::ProgramResult;
using haptic::sim::test::run_program;
using haptic::sim::test::ScratchFolder;
using haptic::tools::formatted;
using nlohmann::json;

namespace {

void write(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

std::string last_line(const std::string& text) {
  const std::size_t end = text.find_last_not_of('\n');
  const std::size_t begin = text.rfind('\n', end);
  return text.substr(begin == std::string::npos ? 0 : begin + 1, end - begin);
}

/// A part or a fixed part by its dimensions.
std::string box(const std::array<double, 3>& size_m, const std::array<double, 3>& at_m) {
  return formatted(
      "shape = \"box\"\nsize_m = [%.9g, %.9g, %.9g]\nposition_m = [%.9g, %.9g, %.9g]\n", size_m[0],
      size_m[1], size_m[2], at_m[0], at_m[1], at_m[2]);
}

/// `moving`, `fixed`: tables without their heads; `rest`: further tables.
std::string scene_text(const std::string& moving, const std::vector<std::string>& fixed,
                       const std::string& rest = {}) {
  std::string text = "format = 1\nname = \"verdict\"\n[moving]\n" + moving;
  for (const std::string& part : fixed) text += "[[static]]\n" + part;
  return text + "[rendering]\nk_f_n_per_m = 800\n" + rest;
}

/// Way points: time, then place.
std::string motion_text(const std::vector<std::array<double, 4>>& points) {
  std::string text = "format = 1\n";
  for (const auto& p : points) {
    text += formatted("[[waypoint]]\nt_s = %.9g\nposition_m = [%.9g, %.9g, %.9g]\n", p[0], p[1],
                      p[2], p[3]);
  }
  return text;
}

/// A compiled scene in a folder of its own.
struct Compiled {
  ScratchFolder folder{"verdict"};
  std::string scene = "'" + folder.file("s.rtscene") + "'",
              motion = "'" + folder.file("m.csv") + "'";

  explicit Compiled(const std::string& text) {
    write(folder.file("scene.toml"), text);
    const ProgramResult r =
        run_program(HAPTIC_GRAPH_COMPILER, "'" + folder.file("scene.toml") + "' -o " + scene);
    CAPTURE(text);
    CAPTURE(r.err);
    REQUIRE(r.exit_code == 0);
  }
  void script(const std::vector<std::array<double, 4>>& points) const {
    write(folder.file("motion.toml"), motion_text(points));
    const ProgramResult r =
        run_program(HAPTIC_HOST_SIM, "motion '" + folder.file("motion.toml") + "' -o " + motion);
    REQUIRE(r.exit_code == 0);
  }
  [[nodiscard]] ProgramResult replay(const std::string& options = {}) const {
    return run_program(HAPTIC_HOST_SIM, "replay " + scene + " --motion " + motion + " " + options);
  }
  [[nodiscard]] ProgramResult motion_for() const {
    return run_program(HAPTIC_HOST_SIM, "motion --for " + scene + " -o " + motion);
  }
  [[nodiscard]] ProgramResult run(const std::string& options = {}) const {
    return run_program(HAPTIC_HOST_SIM, "run " + scene + " " + options);
  }
};

/// A session that ends well, and says so in its last line.
void check_right(const ProgramResult& r) {
  const std::string last = last_line(r.out);
  CAPTURE(r.err);
  CAPTURE(last);
  CHECK(r.exit_code == 0);
  CHECK(last.starts_with("followed the hand in "));
}

/// A session that fails: exit code, last line, and the same as JSON.
void check_failed(const ProgramResult& r, const char* words) {
  const std::string last = last_line(r.out);
  CAPTURE(r.err);
  CAPTURE(last);
  CHECK(r.exit_code == 1);
  CHECK(last.starts_with("FAILED: "));
  CHECK(last.find(words) != std::string::npos);
}

void check_failed_json(const ProgramResult& r, const char* outcome) {
  CHECK(r.exit_code == 1);
  const json verdict = json::parse(r.out)["verdict"];
  CAPTURE(verdict.dump());
  bool found = false;
  for (const json& failure : verdict["failures"]) found = found || failure == outcome;
  CHECK(found);
  CHECK(verdict["text"].get<std::string>().starts_with("FAILED: "));
}

const std::string kPlate = box({0.1, 0.1, 0.02}, {0, 0, -0.01});

/// A block over a plate, 10 mm apart.
std::string block_over_plate(const std::string& rest = {}) {
  return scene_text(box({0.02, 0.02, 0.02}, {0, 0, 0.02}), {kPlate}, rest);
}

/// A round part and a round hole as surfaces, whose tick has many pairs to look after.
std::string surface_in_hole(const std::string& rest) {
  const std::string round = "segments = 48\nas = \"surface\"\n";
  return scene_text(
      "shape = \"cylinder\"\nradius_m = 0.01\nheight_m = 0.02\nposition_m = [0, 0, 0.05]\n" + round,
      {"shape = \"tube\"\ninner_radius_m = 0.0103\nouter_radius_m = 0.02\nheight_m = 0.03\n"
       "position_m = [0, 0, 0.015]\n" +
           round,
       kPlate},
      rest);
}

/// Into the hole of surface_in_hole, against its wall and floor, and out.
const std::vector<std::array<double, 4>> kIntoHole = {{0, 0, 0, 0.05},
                                                      {0.4, 0.001, 0.0005, 0.02},
                                                      {0.8, -0.001, -0.002, 0.009},
                                                      {1.2, 0.002, 0.001, 0.008},
                                                      {1.6, 0, 0, 0.05}};

/// A right scene, drawn from `seed`: how parts commonly meet, with other sizes, clearances,
/// frictions and kinds each time.
std::string right_scene(std::uint64_t seed) {
  haptic::tools::SplitMix64 random(seed);
  const auto draw = [&random](double low, double high) {
    return low + (high - low) * random.uniform();
  };
  const double x = draw(0.008, 0.03), y = draw(0.008, 0.03), z = draw(0.01, 0.05);
  const double gap = draw(2e-5, 1e-3), wall = draw(0.01, 0.03), deep = draw(0.005, 0.02);
  const std::string as = seed % 5 == 4 ? "as = \"surface\"\n" : "";
  std::string moving = box({x, y, z}, {0, 0, z / 2 + draw(0.002, 0.02)}) + as;
  if (seed % 4 == 3) {
    moving =
        formatted(
            "shape = \"cylinder\"\nradius_m = %.9g\nheight_m = %.9g\nposition_m = [0, 0, %.9g]\n",
            x / 2, z, z / 2 + draw(0.002, 0.02)) +
        as;
  }
  std::vector<std::string> fixed;
  if (seed % 3 == 0) {  // lies on a plate
    fixed = {box({0.1, 0.1, wall}, {0, 0, -wall / 2})};
  } else if (seed % 3 == 1) {  // enters a slot
    fixed = {box({wall, 0.1, deep}, {-x / 2 - gap - wall / 2, 0, -deep / 2}),
             box({wall, 0.1, deep}, {x / 2 + gap + wall / 2, 0, -deep / 2}),
             box({0.1, 0.1, wall}, {0, 0, -deep - wall / 2})};
  } else {  // enters a hole with four walls
    const double hx = x / 2 + gap, hy = (seed % 4 == 3 ? x : y) / 2 + gap;
    fixed = {box({wall, 2 * hy, deep}, {-hx - wall / 2, 0, -deep / 2}),
             box({wall, 2 * hy, deep}, {hx + wall / 2, 0, -deep / 2}),
             box({2 * (hx + wall), wall, deep}, {0, -hy - wall / 2, -deep / 2}),
             box({2 * (hx + wall), wall, deep}, {0, hy + wall / 2, -deep / 2}),
             box({0.1, 0.1, wall}, {0, 0, -deep - wall / 2})};
  }
  std::string rest =
      "[device]\nmass_kg = 0.1\ndamping_ns_per_m = 1\n[budget]\nwork_units = 20000\n";
  if (seed % 2 == 1) {
    moving += "material = \"steel\"\n";
    for (std::string& part : fixed) part += "material = \"steel\"\n";
    rest +=
        formatted("[[friction]]\nmaterials = [\"steel\", \"steel\"]\nmu = %.3g\n", draw(0.05, 0.4));
  }
  return scene_text(moving, fixed, rest);
}

void check_right_scenes(std::uint64_t first, std::uint64_t count, std::uint64_t run_every) {
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    CAPTURE(seed);
    const Compiled c(right_scene(seed));
    check_right(c.motion_for());
    check_right(c.replay());
    if (seed % run_every == 0) check_right(c.run());
  }
}

}  // namespace

TEST_SUITE("tools.verdict_programs") {
  TEST_CASE("right scenes fail nothing: motion --for, replay, run") {
    check_right_scenes(0, 10, 5);
  }

  TEST_CASE("a hundred right scenes fail nothing [long]") { check_right_scenes(0, 100, 2); }

  TEST_CASE("a way through free air is right, and it is said that nothing was touched") {
    const Compiled c(block_over_plate());
    c.script({{0, 0, 0, 0.02}, {0.5, 0.01, 0, 0.04}, {1, 0, 0, 0.02}});
    const ProgramResult r = c.replay();
    check_right(r);
    CHECK(last_line(r.out) == "followed the hand in all 1001 ticks; the part touched nothing");
  }

  TEST_CASE("in contact: the felt part, not where the hand's own pose lies in the material") {
    // 1 mm into the plate and back, which holds the part; then beside it, where the hand is in
    // nothing.
    const Compiled c(block_over_plate());
    c.script({{0, 0, 0, 0.02}, {0.5, 0, 0, 0.009}, {1, 0, 0, 0.02}});
    const ProgramResult r = c.replay("--json");
    CHECK(r.exit_code == 0);
    const json account = json::parse(r.out);
    CHECK(account["contact_ticks"] == account["verdict"]["contact_ticks"]);
    CHECK(account["contact_ticks"].get<int>() > 100);
    CHECK(account["contact_ticks"].get<int>() < 900);
    const std::string said = c.replay().out;
    CHECK(said.find(formatted("in contact %d (", account["contact_ticks"].get<int>())) !=
          std::string::npos);
  }

  TEST_CASE("too little work: behind, in every program, and the key that helps") {
    const Compiled c(surface_in_hole("[budget]\nwork_units = 50\n"));
    c.script(kIntoHole);
    check_failed(c.replay(), "ticks behind: [budget] work_units = 800 helps");
    check_failed_json(c.replay("--json"), "behind");
    check_failed(c.motion_for(), "ticks behind: [budget] work_units = 200 helps");
    // In single precision its tolerance is 64 roundings of the scene, several times that of double,
    // and the surfaces take more passes: more than a tenth of the ticks are behind.
    check_failed(c.run("--hand firm"), HAPTIC_REAL_IS_FLOAT
                                           ? "ticks behind: [budget] work_units = 800 helps"
                                           : "ticks behind: [budget] work_units = 200 helps");
    check_failed_json(c.run("--hand firm --json"), "behind");
  }

  TEST_CASE("a start so deep inside that the motion ends there; one that comes out does not fail") {
    const Compiled c(scene_text(box({0.01, 0.01, 0.01}, {0, 0, 0}), {box({1, 1, 1}, {0, 0, 0})},
                                "[motion_limits]\n"
                                "linear_m_per_s = 1\nangular_rad_per_s = 10\n"));
    c.script({{0, 0, 0, 0}, {0.5, 0, 0, 0}});
    check_failed(c.replay(), "inside an obstacle for the last 501 ticks and does not come out");
    check_failed_json(c.replay("--json"), "inside");
    c.script({{0, 0, 0, 0.496}, {2, 0, 0, 0.6}});
    const ProgramResult out = c.replay();
    check_right(out);
    CHECK(
        last_line(out.out).find("inside an obstacle, without force, from the start: give [moving] "
                                "position_m a free place") != std::string::npos);
  }

  TEST_CASE("a device that the gains are not for: energy given out") {
    const Compiled c(block_over_plate(
        "[device]\nmass_kg = 0.1\ndamping_ns_per_m = 0.5\n[coupling]\nk_t_n_per_m = 20000\n"
        "damping_ns_per_m = 0\npassivity = false\nallow_active = true\n"));
    check_failed_json(c.run("--hand light --json"), "energy_given_out");
    check_failed(c.run("--hand light"), "the rendering gave out ");
  }

  TEST_CASE("limits of motion that keep the part from all: made to touch, and touches nothing") {
    const Compiled c(
        block_over_plate("[motion_limits]\nworkspace = { min_m = [-0.05, -0.05, 0.015], max_m = "
                         "[0.05, 0.05, 0.05] }\n"));
    check_failed(c.run(), "the motion touches nothing: give [moving] position_m");
    check_failed_json(c.run("--json"), "nothing_touched");
    // No motion that touches can be made here, which is said instead.
    CHECK(c.motion_for().exit_code == 1);
  }

  TEST_CASE("a picture marks why the part does not follow") {
    const Compiled c(surface_in_hole("[budget]\nwork_units = 50\n"));
    c.script(kIntoHole);
    const std::string plot = c.folder.file("f.svg");
    CHECK(c.replay("--plot '" + plot + "'").exit_code == 1);
    const std::string svg = haptic::sim::test::text_of_file(plot);
    CHECK(svg.find(">lags<") != std::string::npos);
    CHECK(svg.find(">behind<") != std::string::npos);
  }
}
