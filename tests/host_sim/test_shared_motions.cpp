// SPDX-License-Identifier: Apache-2.0
// Real parts with their motions and contact flags, from the mesh to the verdict. Skipped where the
// folder is absent.
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/host_sim/program_run.hpp"

using namespace haptic::sim::test;

namespace {

/// One number, or three for x, y, z, as TOML.
std::string scale_text(const nlohmann::json& scale) { return scale.dump(); }

/// Compiles the task's scene into `folder`; false, with a message, when the task is not there.
bool compile_task(const std::string& task, const ScratchFolder& folder) {
  const std::string data = std::string(HAPTIC_SHARED_DIR) + "/data/" + task;
  if (!std::filesystem::exists(data + "/task.json") ||
      !std::filesystem::exists(data + "/trajectory.csv")) {
    MESSAGE("skipped: no folder ", data);
    return false;
  }
  const auto json = nlohmann::json::parse(text_of_file(data + "/task.json"));
  std::ofstream toml(folder.file("scene.toml"));
  toml << "format = 1\nname = \"" << task << "\"\n";
  for (const char* part : {"moving", "static"}) {
    const auto& p = json.at(part);
    toml << (std::string(part) == "moving" ? "[moving]\n" : "[[static]]\n") << "mesh = \"" << data
         << '/' << p.at("file").get<std::string>()
         << "\"\nscale_to_m = " << scale_text(p.at("scale_to_m")) << '\n';
  }
  toml << "[rendering]\nlaw = \"weighted_region\"\nk_f_n_per_m = 1000.0\nepsilon_m = 1e-4\n";
  toml.close();
  const ProgramResult compiled =
      run_program(HAPTIC_GRAPH_COMPILER, "'" + folder.file("scene.toml") + "' -o '" +
                                             folder.file("scene.rtscene") + "' --quiet");
  REQUIRE_MESSAGE(compiled.exit_code == 0, compiled.err);
  return true;
}

/// Replays the task's own motion; `more`: further options.
void replay_task(const char* task, const std::string& more) {
  const ScratchFolder folder(task);
  if (!compile_task(task, folder)) return;
  const std::string data = std::string(HAPTIC_SHARED_DIR) + "/data/" + task;
  const ProgramResult r =
      run_program(HAPTIC_HOST_SIM, "replay --json --scene '" + folder.file("scene.rtscene") +
                                       "' --motion '" + data + "/trajectory.csv' --reference '" +
                                       data + "/contact_reference.csv' " + more);
  CAPTURE(r.out);
  CAPTURE(r.err);
  CHECK(r.exit_code == 0);
  const auto json = nlohmann::json::parse(r.out);
  const auto& reference = json.at("reference");
  CHECK(reference.at("wrong") == 0);
  CHECK(reference.at("unmatched") == 0);
  CHECK(reference.at("contact").get<int>() > 50);
  CHECK(reference.at("free").get<int>() > 50);
  CHECK(json.at("within_bounds") == true);
  if (json.contains("check")) {
    CHECK(json["check"].at("wrong_verdict_pair_ticks") == 0);
    CHECK(json["check"].at("wrong_d_near_pair_ticks") == 0);
  }
}

}  // namespace

TEST_SUITE("host_sim.shared_motions") {
  TEST_CASE("square peg: every decided contact flag is reproduced") {
    replay_task("square_peg", "");
  }
  TEST_CASE("cube in cup: every decided contact flag is reproduced") {
    replay_task("cube_in_cup", "");
  }
  TEST_CASE("rectangular peg: every decided contact flag is reproduced") {
    replay_task("rect_peg_16mm", "");
  }

  TEST_CASE("square peg: every tick agrees with the exhaustive search [long]") {
    replay_task("square_peg", "--check");
  }
  TEST_CASE("cube in cup: every tick agrees with the exhaustive search [long]") {
    replay_task("cube_in_cup", "--check");
  }
  TEST_CASE("rectangular peg: every tick agrees with the exhaustive search [long]") {
    replay_task("rect_peg_16mm", "--check");
  }
}
