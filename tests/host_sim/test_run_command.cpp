// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "host_sim/device/loop_run.hpp"
#include "host_sim/device/pressing_script.hpp"
#include "host_sim/lab/surface_fuzz/surface_scene.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "rt_core/safety/arming.hpp"
#include "tests/support/program_run.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

/// A cube inside the reach of a wall whose surface is at z = 0; A starts at the origin of W, so the
/// wall stands 20 mm below the cube's lower face.
std::vector<std::byte> scene_bytes(LawId law = LawId::kPaper, double k_n_per_m = 800) {
  const Solid wall = box_solid("wall", {-0.1, -0.1, -0.08}, {0.1, 0.1, -0.03});
  return scene_of(centred_box("cube", 0.01, 0.01, 0.01), {&wall, 1}, k_n_per_m, 1e-4, law);
}

std::string scene_file(const test::ScratchFolder& folder,
                       const std::vector<std::byte>& bytes = scene_bytes(),
                       const std::string& name = "wall.rtscene") {
  const std::string path = folder.file(name);
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  return path;
}

/// Rows of a CSV by the names of its head.
std::vector<std::map<std::string, std::string>> rows_of(const std::string& csv) {
  const auto cells_of = [](const std::string& line) {
    std::vector<std::string> cells;
    std::stringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    return cells;
  };
  std::stringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string> head = cells_of(line);
  std::vector<std::map<std::string, std::string>> rows;
  while (std::getline(lines, line)) {
    const std::vector<std::string> cells = cells_of(line);
    REQUIRE(cells.size() == head.size());
    rows.emplace_back();
    for (std::size_t k = 0; k < cells.size(); ++k) rows.back()[head[k]] = cells[k];
  }
  return rows;
}

struct CarrierRun {
  nlohmann::json account;
  std::string csv, svg;
};

CarrierRun run_carrier(const std::string& options, const std::string& out, int exit_code = 0) {
  const test::ProgramResult result = test::run_program(
      HAPTIC_HOST_SIM, "run --json --hand firm --seconds 2 " + options + " --out '" + out + "'");
  CAPTURE(result.err);
  REQUIRE(result.exit_code == exit_code);
  CarrierRun run{nlohmann::json::parse(result.out), test::text_of_file(out + "/run.csv"),
                 test::text_of_file(out + "/run.svg")};
  CHECK(nlohmann::json::parse(test::text_of_file(out + "/run.json")) == run.account);
  return run;
}

double number_of(const std::map<std::string, std::string>& row, const char* name) {
  return std::stod(row.at(name));
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

  TEST_CASE("pressing script: a surface is pressed where the part cannot follow") {
    SurfaceScene scene;
    scene.name = "surface";
    scene.part = box_mesh_of({0.01, 0.01, 0.01});
    scene.around = box_mesh_of({0.05, 0.05, 0.01});
    scene.around_as = PartKind::kSurface;
    CoreSession session(compiled_surface(scene, 0, kDefaultProxyPasses).blob, "surface");
    const double pressed_m = pressing_script(session, 1000, 2.0).waypoints[1].p[2];
    CHECK(pressed_m < 0.0171);
    CHECK(pressed_m > 0.0163);
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
      CHECK(head.starts_with(tick_columns(TickTable::kCsv)));
      CHECK(count_of(csv[k], ',') == 2002 * count_of(head, ','));
      CHECK(test::text_of_file(out + "/run.svg").find("</svg>") != std::string::npos);
      CHECK(nlohmann::json::parse(test::text_of_file(out + "/run.json")) == json);
    }
    CHECK(csv[0] == csv[1]);
  }

  TEST_CASE(
      "run: a scene that names no device is rendered as stiff as the simulated one holds it") {
    const test::ScratchFolder folder("run_gains");
    // The default device holds 1001 N/m and 1 N m/rad; a loose hand adds little.
    const std::vector<std::byte> bytes = scene_bytes(LawId::kProxy, 20'000);
    const std::string scene = scene_file(folder, bytes);
    const auto run = [&](const std::string& of, const std::string& options) {
      return test::run_program(HAPTIC_HOST_SIM,
                               "run '" + of + "' --json --seconds 3 --hand loose " + options);
    };
    const test::ProgramResult lowered = run(scene, "");
    CAPTURE(lowered.err);
    CHECK(lowered.exit_code == 0);
    CHECK(lowered.err.find("N m/rad, is more than the simulated device holds") !=
          std::string::npos);
    const nlohmann::json json = nlohmann::json::parse(lowered.out);
    const double k_t_n_per_m = json["rendered"]["k_t_n_per_m"];
    CHECK(k_t_n_per_m == doctest::Approx(1000).epsilon(0.02));
    CHECK(json["rendered"]["k_r_nm_per_rad"].get<double>() == doctest::Approx(1).epsilon(0.02));
    CHECK(json["largest_delivered_j"].get<double>() < 1e-3);
    CHECK(lowered.err.find(json["rendered"]["lowered"].get<std::string>()) != std::string::npos);
    // Later, and through the whole stack: less.
    const nlohmann::json late = nlohmann::json::parse(run(scene, "--delay 1").out);
    CHECK(late["rendered"]["k_t_n_per_m"].get<double>() == doctest::Approx(334).epsilon(0.02));
    const nlohmann::json carried = nlohmann::json::parse(run(scene, "--carrier direct").out);
    CHECK(carried["rendered"]["k_t_n_per_m"] == late["rendered"]["k_t_n_per_m"]);
    CHECK(carried["passed"] == true);
    // Asked for as it is, the loop gives energy out: that is why.
    CoreSession session(bytes, "wall");
    session.change([](SceneParameters& p) { p.coupling.allow_active = 1; });
    const std::span<const std::byte> active = session.view().blob();
    const test::ProgramResult as_is =
        run(scene_file(folder, {active.begin(), active.end()}, "active.rtscene"), "");
    CAPTURE(as_is.err);
    CHECK(as_is.exit_code == 1);
    const nlohmann::json wild = nlohmann::json::parse(as_is.out);
    CHECK(wild["rendered"]["k_t_n_per_m"] == 20'000);
    CHECK(wild["largest_delivered_j"].get<double>() > 1e-3);
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

  TEST_CASE("carriers: the same bytes directly and through libusb, and the columns of none") {
    const test::ScratchFolder folder("run_carriers");
    const std::string scene = "--scene '" + scene_file(folder) + "' ";
    const CarrierRun none = run_carrier(scene, folder.file("none"));
    CHECK(!none.account.contains("carrier"));
    const std::string head = none.csv.substr(0, none.csv.find('\n'));
    for (const std::string clock : {"", " --report-clocked"}) {
      CAPTURE(clock);
      const CarrierRun direct =
          run_carrier(scene + "--carrier direct" + clock, folder.file("direct" + clock));
      const CarrierRun usb =
          run_carrier(scene + "--carrier usb" + clock, folder.file("usb" + clock));
      CHECK(direct.csv == usb.csv);
      CHECK(usb.csv.rfind(head + ",arming,faults,device_faults,link,drives_on,handed_fx_n", 0) ==
            0);
      CHECK(usb.svg.find("handed over") != std::string::npos);
      CHECK(usb.svg.find("</svg>") != std::string::npos);
      const nlohmann::json& json = usb.account;
      CHECK(json["carrier"] == "usb");
      CHECK(json["report_clocked"] == !clock.empty());
      CHECK(json["ticks"] == 2000);
      CHECK(json["armings"] == 1);
      CHECK(json["faults"].empty());
      CHECK(json["link"]["reports"] == 2000);
      CHECK(json["link"]["sent"] == json["sends"]);
      CHECK(json["limits"]["max_force_n"] == 12);
      // By the timer a wrench is a period late, and of the 800 N/m the device holds 267.
      CHECK(json["largest_handed_force_n"].get<double>() ==
            doctest::Approx(clock.empty() ? 0.6 : 1.2).epsilon(0.15));
      CHECK(json["largest_handed_force_step_n"].get<double>() > 0);
      CHECK(json["ended_at_zero"] == true);
      CHECK(direct.account["link"]["reports"] == 0);
      CHECK(direct.account["sends"] == json["sends"]);
    }
  }

  TEST_CASE("carriers: force only while armed, and only what was handed over acts") {
    const test::ScratchFolder folder("run_arming");
    const std::string scene = "--scene '" + scene_file(folder) + "' ";
    const CarrierRun run = run_carrier(scene + "--carrier usb --report-clocked", folder.file("o"));
    const auto rows = rows_of(run.csv);
    REQUIRE(rows.size() == 2000);
    double last_n = 0;
    std::size_t armed = 0;
    for (const auto& row : rows) {
      const double t_s = number_of(row, "t_s"), handed_n = number_of(row, "handed_fz_n");
      if (t_s < 0.0995) CHECK(row.at("arming") == "disarmed");
      if (row.at("arming") == "disarmed") CHECK(handed_n == 0);
      // The units of the protocol, and a period of the device.
      CHECK(number_of(row, "acting_fz_n") == doctest::Approx(last_n).epsilon(1e-4));
      armed += row.at("arming") == "armed" ? 1u : 0u;
      last_n = handed_n;
    }
    CHECK(armed > 1500);
    CHECK(rows.back().at("arming") == "disarmed");
    CHECK(rows.back().at("link") == "ready");
  }

  TEST_CASE("carriers: a device file sets model and limits") {
    const test::ScratchFolder folder("run_limits");
    const std::string scene = "--scene '" + scene_file(folder) + "' ", file = folder.file("d.toml");
    std::ofstream(file) << "[device]\nmass_kg = 0.3\nmax_force_n = 0.5\nmax_torque_nm = 0.1\n";
    const CarrierRun run =
        run_carrier(scene + "--carrier usb --device '" + file + "'", folder.file("o"));
    CHECK(run.account["device"]["mass_kg"] == 0.3);
    CHECK(run.account["limits"]["max_force_n"] == 0.5);
    CHECK(run.account["limits"]["max_torque_nm"].get<double>() == doctest::Approx(0.1));
    CHECK(run.account["largest_force_n"].get<double>() > 0.6);  // rendered
    CHECK(run.account["largest_handed_force_n"].get<double>() <= 0.5 * (1 + 1e-6));
  }

  TEST_CASE("carriers: a fault script is played, shown and survived") {
    const test::ScratchFolder folder("run_faults");
    const std::string scene = "--scene '" + scene_file(folder) + "' ", file = folder.file("f.toml");
    std::ofstream(file) << "format = 1\n[[fault]]\nkind = \"corrupt\"\nreport = 500\n"
                           "[[fault]]\nkind = \"unplug\"\nt_s = 1.0\n"
                           "[[fault]]\nkind = \"replug\"\nt_s = 1.2\namount = 1\n";
    const std::string options = scene + "--carrier usb --faults '" + file + "'";
    const CarrierRun run = run_carrier(options, folder.file("o"));
    const nlohmann::json& json = run.account;
    CHECK(json["fault_script"] == file);
    CHECK(json["link"]["bad_check"] == 1);
    CHECK(json["link"]["connects"] == 2);
    CHECK(json["link"]["disconnects"] == 1);
    CHECK((json["fault_bits"].get<std::uint32_t>() & kFaultDeviceLost) != 0u);
    CHECK(json["first_fault_at_s"].get<double>() == doctest::Approx(1.0).epsilon(0.01));
    CHECK(json["armings"] == 1);  // the deadman stays held: nothing comes back
    for (const auto& row : rows_of(run.csv)) {
      if (number_of(row, "t_s") > 1.25) CHECK(number_of(row, "handed_fz_n") == 0);
    }
    CHECK(run_carrier(options, folder.file("again")).csv == run.csv);
    std::ofstream(file) << "format = 1\n[[fault]]\nkind = \"gremlin\"\nreport = 5\n";
    CHECK(test::run_program(HAPTIC_HOST_SIM, "run " + options).exit_code == 3);
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
    CHECK(code("--scene '" + scene + "' --carrier serial") == 2);
    CHECK(code("--scene '" + scene + "' --report-clocked") == 2);
    CHECK(code("--scene '" + scene + "' --faults '" + scene + "'") == 2);
    CHECK(code("--scene '" + scene + "' --carrier direct --faults '" + scene + "'") == 2);
    CHECK(code("--scene '" + scene + "' --carrier usb --rate 20") == 2);
    CHECK(code("--scene '" + scene + "' --carrier usb --faults '" + folder.file("none") + "'") ==
          3);
    CHECK(code("--scene '" + folder.file("none") + "'") == 3);
    CHECK(code("--scene '" + scene + "' --script '" + folder.file("none") + "'") == 3);
    CHECK(code("--scene '" + scene + "' --device '" + scene + "'") == 3);
  }
}
