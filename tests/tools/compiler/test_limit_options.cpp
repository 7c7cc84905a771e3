// SPDX-License-Identifier: Apache-2.0
// The limits of the decomposition as a user meets them: refused with count, limit and fix and with
// nothing written, or a scene that scene_inspect finds sound.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "tests/tools/compiler/part_scenes.hpp"

using namespace haptic::test;
using haptic::sim::test::ProgramResult;
using haptic::sim::test::run_program;
using haptic::sim::test::ScratchFolder;
using haptic::sim::test::text_of_file;
namespace fs = std::filesystem;

namespace {

using Outline = std::vector<std::array<double, 2>>;

/// Upright prisms over counter-clockwise outlines, as one OBJ of several shells.
struct Prism {
  Outline outline;
  double low = 0.0, high = 0.02;
};
void write_prisms(const std::string& path, const std::vector<Prism>& prisms) {
  std::ofstream out(path);
  out.precision(17);
  std::size_t first = 1;
  for (const Prism& p : prisms) {
    const std::size_t n = p.outline.size();
    for (const double z : {p.low, p.high}) {
      for (const auto& [x, y] : p.outline) out << "v " << x << ' ' << y << ' ' << z << '\n';
    }
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t next = (k + 1) % n;
      out << "f " << first + k << ' ' << first + next << ' ' << first + n + next << ' '
          << first + n + k << '\n';
    }
    for (const bool top : {false, true}) {
      out << 'f';
      for (std::size_t k = 0; k < n; ++k) out << ' ' << first + (top ? n + k : n - 1 - k);
      out << '\n';
    }
    first += 2 * n;
  }
}

Outline rectangle(double x0, double y0, double x1, double y1) {
  return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

/// An L of 60 mm, its inner corner rounded with `chords` chords: one reflex edge more than chords.
constexpr double kRadius_m = 0.002;
Outline filleted_l(int chords) {
  Outline out{{0, 0}, {0.06, 0}, {0.06, 0.02}};
  const double middle = 0.02 + kRadius_m;
  for (int k = 0; k <= chords; ++k) {
    const double angle = 0.5 * std::numbers::pi * k / chords;
    out.push_back({middle - kRadius_m * std::sin(angle), middle - kRadius_m * std::cos(angle)});
  }
  out.push_back({0.02, 0.06});
  out.push_back({0, 0.06});
  return out;
}

/// A wheel of 2 n corners, every second one reflex.
Outline star(int n) {
  Outline out;
  for (int k = 0; k < 2 * n; ++k) {
    const double angle = std::numbers::pi * k / n, r = k % 2 == 0 ? 0.04 : 0.02;
    out.push_back({r * std::cos(angle), r * std::sin(angle)});
  }
  return out;
}

/// Outputs of an earlier run, by their beginnings.
const std::string kOldScene("RTSCENE\0old scene", 17), kOldReport = "{\"scene\": \"old\"}";

/// A cube of 1 cm in the hand and the part given; every run starts from old outputs.
class Bench {
 public:
  explicit Bench(const std::vector<Prism>& part) {
    write_cube(folder_.file("cube.obj"));
    write_prisms(folder_.file("part.obj"), part);
    write_scene("");
  }
  void write_scene(const std::string& keys) {
    std::ofstream(folder_.file("scene.toml"))
        << "format = 1\nname = \"limits\"\n[moving]\nmesh = \"cube.obj\"\nscale_to_m = 0.01\n"
           "position_m = [0, 0, 0.1]\n[[static]]\nmesh = \"part.obj\"\nscale_to_m = 1.0\n"
           "as = \"solid\"\n"
        << keys << "[rendering]\nk_f_n_per_m = 800\n";
  }
  ProgramResult compile(const std::string& options) {
    std::ofstream(scene()) << kOldScene;
    std::ofstream(report()) << kOldReport;
    return run_program(HAPTIC_GRAPH_COMPILER, folder_.file("scene.toml") + " --quiet -o " +
                                                  scene() + " --report " + report() + " " +
                                                  options);
  }
  /// Exit code 3, these words, and nothing written or left.
  void refuses(const std::string& options, const std::vector<std::string>& words) {
    CAPTURE(options);
    const ProgramResult r = compile(options);
    CHECK(r.exit_code == 3);
    CAPTURE(r.err);
    CHECK(r.err.find("part.obj: ") != std::string::npos);
    for (const std::string& word : words) {
      CAPTURE(word);
      CHECK(r.err.find(word) != std::string::npos);
    }
    CHECK(text_of_file(scene()) == kOldScene);
    CHECK(text_of_file(report()) == kOldReport);
    CHECK(std::distance(fs::directory_iterator(folder_.file("")), fs::directory_iterator()) == 5);
  }
  /// Exit code 0 and a sound scene; the account of the part.
  nlohmann::json accepts(const std::string& options) {
    CAPTURE(options);
    const ProgramResult r = compile(options);
    CAPTURE(r.err);
    REQUIRE(r.exit_code == 0);
    said = r.err;
    const ProgramResult inspected = run_program(HAPTIC_SCENE_INSPECT, scene() + " --json");
    CHECK(inspected.exit_code == 0);
    facts = nlohmann::json::parse(inspected.out)["parts"][1];
    const nlohmann::json part = read_json(report())["parts"][1];
    CHECK(part["certificate"]["holds"] == true);
    CHECK(part["pieces"].size() == facts["pieces"].size());
    return part;
  }
  [[nodiscard]] std::string scene() const { return folder_.file("a.rtscene"); }
  [[nodiscard]] std::string report() const { return folder_.file("a.json"); }

  std::string said;      ///< on standard error, when last accepted
  nlohmann::json facts;  ///< of the part, by scene_inspect

 private:
  ScratchFolder folder_{"limits"};
};

std::string unwrapped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const bool blank = c == ' ' || c == '\n';
    if (!blank || out.empty() || out.back() != ' ') out += blank ? ' ' : c;
  }
  return out;
}

doctest::Approx about(double value, double relative) {
  return doctest::Approx(value).epsilon(relative).scale(0.0);
}

}  // namespace

TEST_SUITE("tools.limit_options") {
  TEST_CASE("--max-reflex: count, limit and fix; at the limit it is accepted") {
    Bench bench({{filleted_l(8)}});
    bench.refuses("--max-reflex 8",
                  {"9 reflex edges, limit 8", "--simplify DISTANCE", "raise --max-reflex"});
    CHECK(bench.accepts("--max-reflex 9")["reflex_edges"] == 9);
  }

  TEST_CASE("--max-pieces: limit and fix; at the limit it is accepted") {
    Bench bench({{filleted_l(4)}});
    const std::size_t needed = bench.accepts("")["pieces"].size();
    CHECK(needed > 2);
    bench.refuses("--max-pieces " + std::to_string(needed - 1),
                  {"needs more than " + std::to_string(needed - 1) + " convex pieces, the limit",
                   "--simplify DISTANCE", "raise --max-pieces"});
    CHECK(bench.accepts("--max-pieces " + std::to_string(needed))["pieces"].size() == needed);
  }

  TEST_CASE("--work-limit: refused before a first result, later the best so far with a warning") {
    Bench bench({{star(7)}});
    const nlohmann::json all = bench.accepts("");
    CHECK(bench.said.find("work limit") == std::string::npos);
    const double work = all["work"];
    bench.refuses(
        "--work-limit " + std::to_string(0.02 * work),
        {"solid 1 of 1 near", "7 reflex edges", "before a first decomposition was complete",
         "--simplify DISTANCE", "raise --work-limit"});
    const nlohmann::json cut = bench.accepts("--work-limit " + std::to_string(0.6 * work));
    CHECK(bench.said.find("work limit") != std::string::npos);
    CHECK(bench.said.find("the best result so far is used") != std::string::npos);
    CHECK(cut["pieces"].size() >= all["pieces"].size());
    CHECK(cut["work"] < all["work"]);
  }

  TEST_CASE("--disjoint: a cover is cut apart, by the option and by the scene's key") {
    Bench bench({{rectangle(0, 0, 0.05, 0.02), 0.0, 0.02},
                 {rectangle(0.01, -0.02, 0.03, 0.04), 0.005, 0.015}});
    const double box = 0.05 * 0.02 * 0.02, bar = 0.02 * 0.06 * 0.01, both = 0.02 * 0.02 * 0.01;
    const nlohmann::json cover = bench.accepts("");
    CHECK(cover["pieces"].size() == 2);
    CHECK(cover["certificate"]["cover"] == true);
    CHECK(bench.said.find("solids overlap (1 and 2)") != std::string::npos);
    CHECK(bench.said.find("--disjoint cuts them apart") != std::string::npos);
    CHECK(bench.facts["volume_m3"] == about(box + bar, 1.0e-9));
    CHECK(bench.facts["recheck"]["separated_pairs"] < bench.facts["recheck"]["piece_pairs"]);
    const auto apart = [&](const nlohmann::json& part) {
      CHECK(part["certificate"]["cover"] == false);
      CHECK(part["certificate"]["removed"] > 0);
      CHECK(bench.said.find("overlap") == std::string::npos);
      CHECK(bench.facts["volume_m3"] == about(box + bar - both, 1.0e-9));
      CHECK(bench.facts["recheck"]["separated_pairs"] == bench.facts["recheck"]["piece_pairs"]);
    };
    const nlohmann::json cut = bench.accepts("--disjoint");
    apart(cut);
    bench.refuses("--disjoint --max-pieces " + std::to_string(cut["pieces"].size() - 1),
                  {"the body, cut apart, needs more than", "raise --max-pieces"});
    bench.write_scene("disjoint = true\n");
    apart(bench.accepts(""));
  }

  TEST_CASE("--simplify: what is too curved becomes a scene that says what was given up") {
    constexpr int kChords = 8;
    Bench bench({{filleted_l(kChords)}});
    bench.refuses("--max-reflex 3 --simplify 1e-6",
                  {"9 reflex edges are left of 9 by --simplify 1e-06, limit 3",
                   "give a larger distance, or raise --max-reflex"});
    const nlohmann::json sharp = bench.accepts("--max-reflex 3 --simplify 0.0013");
    CHECK(sharp["pieces"].size() == 2);
    const nlohmann::json& account = sharp["simplified"];
    // From the corner to the middle of the round; the area under the chords of a quarter turn.
    const double distance = kRadius_m * (std::numbers::sqrt2 - 1.0);
    const double fillet = kRadius_m * kRadius_m *
                          (1.0 - 0.5 * kChords * std::sin(0.5 * std::numbers::pi / kChords)) * 0.02;
    CHECK(account["hausdorff_m"] >= distance * (1.0 - 1.0e-6));
    CHECK(account["hausdorff_m"] <= distance * 1.002);
    CHECK(account["hausdorff_at_least_m"] <= distance * (1.0 + 1.0e-6));
    CHECK(account["volume_after_m3"].get<double>() - account["volume_before_m3"].get<double>() ==
          about(-fillet, 1.0e-5));
    CHECK(bench.said.find("warning: part.obj: simplified within 0.0013 m: planes 16 to 8, reflex "
                          "edges 9 to 1") != std::string::npos);
    // The scene itself says it, too.
    CHECK(bench.facts["simplified"]["distance_m"] == account["hausdorff_m"]);
    CHECK(bench.facts["simplified"]["volume_change_m3"] == about(-fillet, 1.0e-5));
    const ProgramResult page = run_program(HAPTIC_SCENE_INSPECT, bench.scene());
    CHECK(unwrapped(page.out).find("NOT the solid of its mesh but was simplified: no point of") !=
          std::string::npos);
    CHECK(page.out.find("SIMPLIFIED: surface within 0.00082") != std::string::npos);
    // Nothing to remove, nothing to say; the part's own key asks like the option.
    const nlohmann::json kept = bench.accepts("--simplify 1e-6");
    CHECK(kept["simplified"]["changed"] == false);
    CHECK(bench.said.find("simplified") == std::string::npos);
    CHECK(bench.facts["simplified"].is_null());
    bench.write_scene("simplify_m = 0.0013\n");
    CHECK(bench.accepts("")["simplified"]["hausdorff_m"] == account["hausdorff_m"]);
  }

  TEST_CASE("a real gear: refused as it is, simplified a scene that scene_inspect proves [long]") {
    if (!fs::exists(shared_part("gear_on_shaft"))) {
      MESSAGE("skipped: no shared parts");
      return;
    }
    const ScratchFolder folder("limits");
    const std::string out = folder.file("a.rtscene"), report = folder.file("a.json");
    const std::string compile =
        write_part_scene("gear_on_shaft", folder) + " --quiet -o " + out + " --report " + report;
    CHECK(run_program(HAPTIC_GRAPH_COMPILER, compile).exit_code == 3);
    for (const double distance : {2.0e-4, 5.0e-4}) {
      CAPTURE(distance);
      const ProgramResult r =
          run_program(HAPTIC_GRAPH_COMPILER, compile + " --simplify " + std::to_string(distance));
      REQUIRE(r.exit_code == 0);
      const nlohmann::json account = read_json(report);
      CHECK(account["parts"].size() == 2);
      for (const nlohmann::json& part : account["parts"]) {
        CHECK(part["certificate"]["holds"] == true);
        CHECK(part["simplified"]["hausdorff_m"] <= distance);
        const double least = part["simplified"]["hausdorff_at_least_m"];
        CHECK(part["simplified"]["hausdorff_m"] <= 1.0011 * least);
      }
      CHECK(run_program(HAPTIC_SCENE_INSPECT, out + " --brief").exit_code == 0);
    }
  }

  TEST_CASE("the options' values: usage errors exit 2") {
    Bench bench({{rectangle(0, 0, 0.05, 0.02)}});
    for (const std::string option : {"--simplify 0", "--simplify -1", "--max-pieces 0",
                                     "--work-limit 0", "--max-reflex -1", "--simplify much"}) {
      CAPTURE(option);
      CHECK(bench.compile(option).exit_code == 2);
      CHECK(text_of_file(bench.scene()) == kOldScene);
    }
  }
}
