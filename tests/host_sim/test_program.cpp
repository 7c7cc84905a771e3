// SPDX-License-Identifier: Apache-2.0
// The program host_sim from outside: options, files, exit codes.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "host_sim/lab/golden/golden_check.hpp"
#include "host_sim/lab/surface_fuzz/surface_scene.hpp"
#include "host_sim/session/motion_csv.hpp"
#include "tests/host_sim/sample_scenes.hpp"
#include "tests/support/program_run.hpp"

using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

ProgramResult host_sim(const std::string& arguments) {
  return run_program(HAPTIC_HOST_SIM, arguments);
}

/// A scene and a motion in files.
struct Files {
  ScratchFolder folder{"program"};
  std::string scene = folder.file("s.rtscene"), motion = folder.file("m.csv");
  std::string both = "--scene '" + scene + "' --motion '" + motion + "'";

  Files() {
    write(scene_of(tetrahedron(), box(0.1, 0.06, 0.05)));
    PathShape shape;
    shape.centre_m[2] = 0.08;
    write_motion_csv(motion, smooth_path(1, 400, shape));
  }
  void write(const std::vector<std::byte>& bytes) const {
    std::ofstream(scene, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  }
};

}  // namespace

TEST_SUITE("host_sim.program") {
  TEST_CASE("a scene of a simplified part: one line on standard error names it") {
    const Files f;
    GoldenFile file;
    file.family = "simplified";
    file.k_f_n_per_m = 1000;
    file.a = tetrahedron();
    file.b = box(0.1, 0.06, 0.05);
    haptic::tools::SceneDescription scene = golden_scene(file, 1e-4);
    scene.statics[0].simplified = {2.5e-4, 0.0};
    f.write(haptic::tools::write_scene(scene));
    const ProgramResult r = host_sim("replay " + f.both + " --check");
    CHECK(r.exit_code == 0);
    CHECK(r.err == "host_sim: warning: " + f.scene +
                       ": 'box' was simplified: the surface is up to 0.00025 m from that of the "
                       "mesh, the volume changed by +0 % (+0 m3)\n");
  }

  TEST_CASE("replay writes CSV and SVG, passes its check, and says the same as JSON") {
    const Files f;
    const std::string out = f.folder.file("o.csv"), plot = f.folder.file("o.svg");
    const ProgramResult text =
        host_sim("replay " + f.both + " --check --out '" + out + "' --plot '" + plot + "'");
    CHECK(text.exit_code == 0);
    CHECK(text.err.empty());
    CHECK(text.out.find("wrong verdicts        0 ticks") != std::string::npos);
    const std::string csv = text_of_file(out);
    CHECK(std::count(csv.begin(), csv.end(), '\n') == 401);
    CHECK(text_of_file(plot).ends_with("</svg>\n"));

    const std::string again = f.folder.file("again.csv");
    const ProgramResult json = host_sim("replay " + f.both + " --json --out '" + again + "'");
    CHECK(json.exit_code == 0);
    CHECK(nlohmann::json::parse(json.out).at("ticks") == 400);
    CHECK(text_of_file(again) == csv);
    CHECK(std::distance(
              std::filesystem::directory_iterator(std::filesystem::path(out).parent_path()), {}) ==
          5);
  }

  TEST_CASE("replay against a reference: exit 0 when it agrees, 1 when it does not") {
    const Files f;
    const std::string good = f.folder.file("good.csv"), bad = f.folder.file("bad.csv"),
                      out = f.folder.file("o.csv");
    REQUIRE(host_sim("replay " + f.both + " --out '" + out + "'").exit_code == 0);
    std::ifstream csv(out);
    std::ofstream right(good), wrong(bad);
    right << "t,contact\n";
    wrong << "t,contact\n";
    std::string line;
    std::getline(csv, line);
    while (std::getline(csv, line)) {
      const auto after = [&](int commas) {
        std::size_t at = 0;
        for (int i = 0; i < commas; ++i) at = line.find(',', at) + 1;
        return line.substr(at, line.find(',', at) - at);
      };
      const bool contact = std::stod(after(8)) <= 0;
      right << after(1) << (contact ? ",1\n" : ",0\n");
      wrong << after(1) << (contact ? ",0\n" : ",1\n");
    }
    right.close();
    wrong.close();
    CHECK(host_sim("replay " + f.both + " --reference '" + good + "'").exit_code == 0);
    CHECK(host_sim("replay " + f.both + " --reference '" + bad + "'").exit_code == 1);
  }

  TEST_CASE("literal steps run in both readings; their check fails where they are wrong") {
    const Files f;
    for (const char* delta : {"dx", "dx-rotation"}) {
      const ProgramResult r = host_sim("replay " + f.both + " --literal --delta " + delta);
      CHECK(r.exit_code == 0);
      CHECK(r.out.find(delta) != std::string::npos);
    }
    const ProgramResult checked =
        host_sim("replay " + f.both + " --literal --delta dx --check --json");
    const auto json = nlohmann::json::parse(checked.out);
    CHECK(checked.exit_code == (json.at("check").at("passed") == true ? 0 : 1));
  }

  TEST_CASE("replay of a surface: checks of the device's pose are refused with what to do") {
    const Files f;
    SurfaceScene surface;
    surface.name = "surface";
    surface.part = box_mesh_of({0.01, 0.01, 0.01});
    surface.around = box_mesh_of({0.05, 0.05, 0.01});
    surface.around_as = PartKind::kSurface;
    f.write(compiled_surface(surface, 0, haptic::kDefaultProxyPasses).blob);
    CHECK(host_sim("replay " + f.both).exit_code == 0);
    const std::string reference = f.folder.file("r.csv");
    std::ofstream(reference) << "t,contact\n0,0\n";
    for (const std::string& option : {std::string("--check"), "--reference '" + reference + "'"}) {
      const ProgramResult r = host_sim("replay " + f.both + " " + option);
      CHECK(r.exit_code == 3);
      CHECK(r.err.find("host_lab surface-fuzz") != std::string::npos);
    }
  }

  TEST_CASE("vectors: 0 for good files, 1 for a wrong expectation, 3 for malformed JSON") {
    const ScratchFolder folder("vectors");
    const std::string good = HAPTIC_TEST_DIR "/golden/tetra_box_face_face.json";
    CHECK(host_sim("vectors '" + good + "'").exit_code == 0);
    CHECK(nlohmann::json::parse(host_sim("vectors --json '" + good + "'").out).at(0).at("passed") ==
          true);
    auto json = nlohmann::json::parse(text_of_file(good));
    json["cases"][1]["D_near"] = "-0.001";
    std::ofstream(folder.file("wrong.json")) << json;
    const ProgramResult wrong = host_sim("vectors '" + folder.file("wrong.json") + "'");
    CHECK(wrong.exit_code == 1);
    CHECK(wrong.err.find("wrong.json: case tetra_box_face_face-01: d_near: expected -0.001") !=
          std::string::npos);
    std::ofstream(folder.file("half.json")) << "{\n\"family\": ";
    const ProgramResult half = host_sim("vectors '" + folder.file("half.json") + "'");
    CHECK(half.exit_code == 3);
    CHECK(half.err.find("half.json:2: ") != std::string::npos);
    json = nlohmann::json::parse(text_of_file(good));
    json["A"]["faces_ccw_outward"].erase(0);
    std::ofstream(folder.file("open.json")) << json;
    const ProgramResult open = host_sim("vectors '" + folder.file("open.json") + "'");
    CHECK(open.exit_code == 3);
    CHECK(open.err.find("open.json") != std::string::npos);
  }

  TEST_CASE("motion and wcet do their work") {
    const Files f;
    const std::string script = f.folder.file("m.toml"), out = f.folder.file("made.csv");
    std::ofstream(script)
        << "format = 1\n[[waypoint]]\nphase=\"a\"\nt_s=0.0\nposition_m=[0,0,0.2]\n"
           "[[waypoint]]\nphase=\"b\"\nt_s=0.1\nposition_m=[0,0,0.05]\n";
    CHECK(host_sim("motion '" + script + "' --out '" + out + "'").exit_code == 0);
    const ProgramResult once =
        host_sim("wcet --once --scene '" + f.scene + "' --motion '" + out + "'");
    CHECK(once.exit_code == 0);
    CHECK(once.out.find("101 ticks") != std::string::npos);
    const ProgramResult timed =
        host_sim("wcet --quick --evaluations 3 --repeats 2 --scene '" + f.scene + "' --motion '" +
                 out + "' --out '" + f.folder.file("t") + "'");
    CHECK(timed.exit_code == 0);
    CHECK(timed.out.find("exhaustive search, double") != std::string::npos);
    const std::string csv = text_of_file(f.folder.file("t") + "/wcet.csv");
    CHECK(std::count(csv.begin(), csv.end(), '\n') == 102);
  }

  TEST_CASE(
      "usage errors are 2, bad input is 3 with the file named, a missing folder 4, and no output "
      "file appears") {
    const Files f;
    CHECK(host_sim("").exit_code == 2);
    CHECK(host_sim("dance").exit_code == 2);
    CHECK(host_sim("replay --scene x").exit_code == 2);
    CHECK(host_sim("replay " + f.both + " --delta dx").exit_code == 2);  // needs --literal
    CHECK(host_sim("replay " + f.both + " --literal --delta dy").exit_code == 2);
    CHECK(host_sim("wcet " + f.both + " --repeats 0").exit_code == 2);
    CHECK(host_sim("--help").exit_code == 0);
    CHECK(host_sim("--version").exit_code == 0);
    const std::string out = f.folder.file("none.csv");
    const ProgramResult missing = host_sim("replay --scene /nonexistent.rtscene --motion '" +
                                           f.motion + "' --out '" + out + "'");
    CHECK(missing.exit_code == 3);
    CHECK(missing.err.find("/nonexistent.rtscene") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(out));
    CHECK(host_sim("replay --scene '" + f.motion + "' --motion '" + f.motion + "'").exit_code == 3);
    CHECK(host_sim("replay --scene '" + f.scene + "' --motion '" + f.scene + "'").exit_code == 3);
    CHECK(host_sim("replay " + f.both + " --out /nonexistent/o.csv").exit_code == 4);
    CHECK(host_sim("motion /nonexistent.toml --out '" + out + "'").exit_code == 3);
    CHECK(host_sim("vectors /nonexistent.json").exit_code == 3);
  }
}
