// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "host_sim/device/loop_run.hpp"
#include "host_sim/device/pressing_script.hpp"
#include "host_sim/reproduction/shape_scene.hpp"
#include "tests/host_sim/program_run.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

/// A cube inside the reach of a wall whose surface is at z = 0; A starts at the origin of W, so the
/// wall stands 20 mm below the cube's lower face.
std::vector<std::byte> scene_bytes() {
  const Solid wall = box_solid("wall", {-0.1, -0.1, -0.08}, {0.1, 0.1, -0.03});
  return scene_of(centred_box("cube", 0.01, 0.01, 0.01), {&wall, 1}, 800, 1e-4);
}

std::string scene_file(const test::ScratchFolder& folder) {
  const std::vector<std::byte> bytes = scene_bytes();
  const std::string path = folder.file("wall.rtscene");
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  return path;
}

std::size_t count_of(const std::string& text, char c) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), c));
}

}  // namespace

TEST_SUITE("host_sim.run") {
  TEST_CASE("pressing script: straight to the wall, 3 mm beyond, back") {
    CoreSession session(scene_bytes(), "wall");
    const MotionScript script = pressing_script(session, 1000, 2.0);
    REQUIRE(script.waypoints.size() == 5);
    CHECK(script.waypoints[1].p[2] == doctest::Approx(-0.023).epsilon(0.03));
    CHECK(std::abs(script.waypoints[3].p[2] - script.waypoints[1].p[2]) < 1e-12);
    CHECK(script.waypoints[4].p[2] == 0);
    CHECK(make_motion(script).size() == 2001);
  }

  TEST_CASE("run: files, account, energy; equal runs give equal bytes") {
    const test::ScratchFolder folder("run_command");
    const std::string scene = scene_file(folder);
    std::string csv[2];
    for (const int k : {0, 1}) {
      const std::string out = folder.file("out" + std::to_string(k));
      const test::ProgramResult result = test::run_program(
          HAPTIC_HOST_SIM,
          "run --scene '" + scene + "' --seconds 2 --hand firm " + "--json --out '" + out + "'");
      CAPTURE(result.err);
      REQUIRE(result.exit_code == 0);
      const nlohmann::json json = nlohmann::json::parse(result.out);
      CHECK(json["ticks"] == 2001);
      CHECK(json["law"] == "paper");
      CHECK(json["contact_ticks"].get<int>() > 500);
      // 800 N/m against a hand of 800 N/m, 3 mm: 1.2 N.
      CHECK(json["largest_force_n"].get<double>() == doctest::Approx(1.2).epsilon(0.15));
      CHECK(json["largest_delivered_j"].get<double>() < 1e-4);
      csv[k] = test::text_of_file(out + "/run.csv");
      CHECK(count_of(csv[k], '\n') == 2002);
      const std::string head = csv[k].substr(0, csv[k].find('\n'));
      CHECK(head.rfind(kTickCsvHeader, 0) == 0);
      CHECK(count_of(csv[k], ',') == 2002 * count_of(head, ','));
      CHECK(test::text_of_file(out + "/run.svg").find("</svg>") != std::string::npos);
      CHECK(nlohmann::json::parse(test::text_of_file(out + "/run.json")) == json);
    }
    CHECK(csv[0] == csv[1]);
  }

  TEST_CASE("run: device, delay and rate are used") {
    const test::ScratchFolder folder("run_device");
    const std::string scene = scene_file(folder), device = folder.file("device.toml");
    std::ofstream(device) << "[device]\nmass_kg = 0.3\ndamping_ns_per_m = 2\nmax_force_n = 0.5\n";
    const test::ProgramResult result = test::run_program(
        HAPTIC_HOST_SIM, "run --scene '" + scene + "' --seconds 0.5 --rate 2000 --delay 1 --json " +
                             "--device '" + device + "'");
    REQUIRE(result.exit_code == 0);
    const nlohmann::json json = nlohmann::json::parse(result.out);
    CHECK(json["ticks"] == 1001);
    CHECK(json["device"]["mass_kg"] == 0.3);
    CHECK(json["device"]["delay_samples"] == 1);
    CHECK(json["device"]["max_force_n"] == 0.5);
  }

  TEST_CASE("run: exit codes") {
    const test::ScratchFolder folder("run_codes");
    const std::string scene = scene_file(folder);
    const auto code = [](const std::string& arguments) {
      return test::run_program(HAPTIC_HOST_SIM, "run " + arguments).exit_code;
    };
    CHECK(code("") == 2);
    CHECK(code("--scene '" + scene + "' --hand strong") == 2);
    CHECK(code("--scene '" + scene + "' --delay 17") == 2);
    CHECK(code("--scene '" + folder.file("none") + "'") == 3);
    CHECK(code("--scene '" + scene + "' --script '" + folder.file("none") + "'") == 3);
    CHECK(code("--scene '" + scene + "' --device '" + scene + "'") == 3);
  }
}
