// SPDX-License-Identifier: Apache-2.0
// Real parts with their motions and contact flags, from the mesh to the verdict. Skipped where the
// folder is absent.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "tests/support/program_run.hpp"

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
  toml << "[rendering]\nlaw = \"paper\"\nk_f_n_per_m = 1000.0\nepsilon_m = 1e-4\n";
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

/// Leads the part through the task's motion under both laws, with `k_r` as rotational stiffness of
/// the coupling; gives how far short of its place the part stays along the insertion, or a NaN when
/// the task is not there. Its place is the assembled one, or nearer where the device turns earlier.
double shortfall_m(const char* task, double k_r_nm_per_rad, double& clearance_m) {
  const ScratchFolder folder(std::string("laws_") + task);
  if (!compile_task(task, folder)) return std::numeric_limits<double>::quiet_NaN();
  const std::string data = std::string(HAPTIC_SHARED_DIR) + "/data/" + task;
  const auto description = nlohmann::json::parse(text_of_file(data + "/task.json"));
  clearance_m = description.at("clearance").at("per_side_m").get<double>();
  const auto towards = description.at("insertion_direction").get<std::array<double, 3>>();
  const auto place = description.at("assembled_pose").at("position_m").get<std::array<double, 3>>();
  std::ostringstream options;
  options << " --towards " << towards[0] << ',' << towards[1] << ',' << towards[2] << " --k-r "
          << k_r_nm_per_rad;
  const ProgramResult r =
      run_program(HAPTIC_HOST_SIM, "compare-laws --scene '" + folder.file("scene.rtscene") +
                                       "' --motion '" + data + "/trajectory.csv' --out '" +
                                       folder.file("laws") + "'" + options.str());
  CAPTURE(r.err);
  REQUIRE(r.exit_code == 0);
  const auto laws = nlohmann::json::parse(text_of_file(folder.file("laws/compare_laws.json")));
  const auto& proxy = laws.at(1);
  REQUIRE(proxy.at("law") == "proxy");
  // Twice the tolerance of "free"; in single precision that is set by rounding.
  const double allowed_m = HAPTIC_REAL_IS_FLOAT ? 5e-6 : 0.2e-6;
  CHECK(proxy.at("worst_gap_m").get<double>() > -allowed_m);
  CHECK(proxy.at("end_distance_m").get<double>() < 1e-9);  // the motions end in the open
  for (const auto& law : laws) {
    const auto& force = law.at("force_steps").at(0);
    const auto& torque = law.at("torque_steps").at(0);
    MESSAGE(std::string(task), ", law ", law.at("law").get<std::string>(),
            ": largest change of force ", force.at("force_n").get<double>(), " N at ",
            force.at("t_s").get<double>(), " s, of torque ", torque.at("torque_nm").get<double>(),
            " N m at ", torque.at("t_s").get<double>(), " s");
  }
  double assembled = 0;
  for (std::size_t i = 0; i < 3; ++i) assembled += place[i] * towards[i];
  return std::min(assembled, proxy.at("farthest_goal_m").get<double>()) -
         proxy.at("farthest_proxy_m").get<double>();
}

/// Ten times the translational stiffness times the square of the part's half width: then a contact
/// gives way by less than a tenth through turning.
void insert_task(const char* task, double half_width_m) {
  double clearance_m = 0;
  const double short_of_m =
      shortfall_m(task, 10 * 1000.0 * half_width_m * half_width_m, clearance_m);
  if (std::isnan(short_of_m)) return;
  CHECK(short_of_m <= clearance_m);
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

  TEST_CASE("square peg: inserted under the proxy law") { insert_task("square_peg", 0.020); }
  TEST_CASE("cube in cup: inserted under the proxy law") { insert_task("cube_in_cup", 0.0395); }
  TEST_CASE("rectangular peg: inserted under the proxy law") {
    insert_task("rect_peg_16mm", 0.008);
  }
  TEST_CASE("square peg: a coupling soft in rotation lets it tip and hook on the rim") {
    double clearance_m = 0;
    const double short_of_m = shortfall_m("square_peg", 1.0, clearance_m);
    if (std::isnan(short_of_m)) return;
    CHECK(short_of_m > 20 * clearance_m);
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
