// SPDX-License-Identifier: Apache-2.0
// `run_device run` with two devices, each with a hand of one scene: both are handles in its
// process.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/tools/run_device/running_program.hpp"

using haptic::sim::test::ProgramResult;
using haptic::sim::test::text_of_file;
using haptic::test::signal_process;
using namespace haptic::tools::test;
using nlohmann::json;

namespace {

constexpr const char* kTwoHead =
    "scene = \"t.rtscene\"\n[device]\ndriver = \"sim\"\n[device2]\ndriver = \"sim\"\n";

/// A peg in one hand, and the socket for it in the other.
struct TwoBench : Bench {
  TwoBench() : Bench("two_hands", kTwoHead) {}
};

/// Both devices exert a force.
bool both_press(const std::vector<json>& lines) {
  bool presses[2] = {};
  for (const json& line : lines) {
    if (line["kind"] != "status") continue;
    const std::size_t k = line["device"].get<std::size_t>() - 1;
    presses[k] = line["arming"] == "armed" && line["force_n"] > 1.5;
  }
  return presses[0] && presses[1];
}

/// Runs until both press; then does `harm` and waits for the end.
Ended run_pressed(const Bench& bench, const std::function<void(pid_t)>& harm) {
  RunningProgram program(bench, nullptr);
  const bool met = comes_true(std::chrono::seconds(55),
                              [&] { return program.has_ended() || both_press(program.lines()); });
  INFO("standard error so far: " << program.ended().err);
  REQUIRE(met);
  REQUIRE_FALSE(program.has_ended());
  harm(program.pid());
  REQUIRE(comes_true(std::chrono::seconds(90), [&] { return program.has_ended(); }));
  return program.ended();
}

void check_refused(const ProgramResult& r, const std::string& part) {
  CAPTURE(r.err);
  CHECK(r.exit_code == 3);
  CHECK(r.out.empty());
  CHECK(r.err.find(part) != std::string::npos);
}

}  // namespace

TEST_SUITE("tools.run_device.two") {
  TEST_CASE("two devices: one loop, and an account of each; the peg is pressed into the socket") {
    const TwoBench bench;
    const ProgramResult r = bench.run_in_time("--seconds 4 --json");
    CAPTURE(r.err);
    CHECK(r.exit_code == 0);
    const std::vector<json> lines = lines_of(r.out);
    std::uint64_t told[2] = {};
    for (const json& line : lines)
      if (line.contains("device")) told[line["device"].get<std::size_t>() - 1] += 1;
    CHECK(told[0] >= 4);
    CHECK(told[1] >= 4);
    const json& summary = lines.back();
    REQUIRE(summary["kind"] == "summary");
    CHECK_FALSE(summary.contains("link"));
    CHECK(summary["wakeups"]["count"] == summary["ticks"]);
    REQUIRE(summary["devices"].size() == 2);
    for (const json& device : summary["devices"]) {
      CHECK(device["driver"] == "sim");
      CHECK(device["link"]["connects"] == 1);
      CHECK(device["link"]["sent"] == device["peer"]["commands"]);
      CHECK(device["peer"]["refused"] == 0);
      CHECK(device["armings"] >= 1);
      CHECK(device["contact_ticks"] > 500);
      CHECK(device["verdict"]["outcome"] == "followed");
      CHECK(device["ending"]["last_force_n"] == 0.0);
    }
    const double first_n = summary["devices"][0]["largest_force_n"];
    const double second_n = summary["devices"][1]["largest_force_n"];
    CHECK(first_n > 1.0);
    // Each feels what the other does, but for the damping of a hand that was a report ahead.
    CHECK(std::abs(first_n - second_n) < 0.2 * first_n);
    const std::string verdict = summary["verdict"]["text"];
    CHECK(verdict.find("device 1: followed the hand") == 0);
    CHECK(verdict.find("; device 2: followed the hand") != std::string::npos);
  }

  TEST_CASE("the tables of the second device are its own; [device2] is not needed with --device2") {
    const TwoBench bench;
    write(bench.config, std::string("scene = \"t.rtscene\"\n[device]\ndriver = \"sim\"\n") +
                            "[limits]\nmax_force_n = 0.5\n");
    ProgramResult r = bench.run_in_time("--device2 sim --seconds 3 --json");
    CAPTURE(r.err);
    CHECK(r.exit_code == 0);
    json devices = lines_of(r.out).back()["devices"];
    CHECK(devices[0]["largest_force_n"] <= 0.501);
    CHECK(devices[1]["largest_force_n"] > 1.0);
    write(bench.config, std::string(kTwoHead) + "[limits2]\nmax_force_n = 0.5\n");
    r = bench.run_in_time("--seconds 3 --json");
    devices = lines_of(r.out).back()["devices"];
    CHECK(devices[0]["largest_force_n"] > 1.0);
    CHECK(devices[1]["largest_force_n"] <= 0.501);
    // A switch that nobody presses.
    write(bench.config, std::string(kTwoHead) +
                            "[switches2]\ndeadman_input = \"/nowhere/key\"\ndeadman_key = 30\n");
    r = bench.run_in_time("--seconds 2 --json");
    CAPTURE(r.err);
    CHECK(r.exit_code == 0);
    devices = lines_of(r.out).back()["devices"];
    CHECK(devices[0]["armed_ticks"] > 0);
    CHECK(devices[1]["armed_ticks"] == 0);
    CHECK(devices[1]["waits_for"].get<std::string>().find("[switches2] deadman") !=
          std::string::npos);
    CHECK(r.err.find("device 2: not armed: ") != std::string::npos);
  }

  TEST_CASE("--ticks: as many from the first on in which a device is armed") {
    const TwoBench bench;
    const ProgramResult r = bench.run("--ticks 400 --seconds 60 --json");
    CAPTURE(r.err);
    CHECK(r.exit_code == 0);
    const json summary = lines_of(r.out).back();
    CHECK(summary["why"] == "the ticks asked for are done");
    CHECK(summary["ticks"] == 400);
    for (const char* name : {"wakeups", "tick"}) CHECK(summary[name]["count"] == 400);
    for (const json& device : summary["devices"]) CHECK(device["armed_ticks"] > 0);
  }

  TEST_CASE("as many devices as hands, told apart; else refused with the fix") {
    const TwoBench bench;
    const std::string one = "scene = \"t.rtscene\"\n[device]\ndriver = \"sim\"\n";
    write(bench.config, one);
    check_refused(bench.run("--seconds 1"),
                  "has two hands, and there is one device; add the table "
                  "[device2]");
    const Bench single("tetrahedron_on_box", kHead);
    check_refused(single.run("--device2 sim --seconds 1"), "is of a second hand, and ");
    for (const char* table : {"workspace2", "limits2", "switches2"}) {
      CAPTURE(table);
      write(bench.config, one + "[" + table + "]\n");
      check_refused(bench.run("--seconds 1"), "run.toml:4:");
      check_refused(bench.run("--seconds 1"), "add the table [device2] with driver");
    }
    for (const char* key :
         {"offset_m = [0, 0, 0]\n", "part_rotation = { w = 1, x = 0, y = 0, z = 0 }\n"}) {
      write(bench.config, std::string(kTwoHead) + "[workspace2]\n" + key);
      check_refused(bench.run("--seconds 1"), "run.toml:7:");
    }
    write(bench.config, "scene = \"t.rtscene\"\n[device]\ndriver = \"reference\"\n[device2]\n");
    check_refused(bench.run("--seconds 1"), "[device2] driver is missing");
    const std::string both = "scene = \"t.rtscene\"\n[device]\ndriver = \"reference\"\n";
    for (const auto& [first, second] :
         {std::pair("", ""), std::pair("1209:0001:a", "1209:0001"),
          std::pair("1209:0001:a", "1209:0001:a"), std::pair("unix:a", "unix:a")}) {
      const std::string address = "address = \"", quote = "\"\n";
      const auto line = [&](const std::string& at) {
        return at.empty() ? std::string() : address + at + quote;
      };
      write(bench.config,
            both + line(first) + "[device2]\ndriver = \"reference\"\n" + line(second));
      check_refused(bench.run("--seconds 1"), "cannot be told from [device]");
    }
    CHECK(bench.run("--device2 joystick").exit_code == 2);
    write(bench.config, kTwoHead);
    const ProgramResult served = bench.run("--serve --seconds 1");
    CHECK(served.exit_code == 2);
    CHECK(served.err.find("leave it out") != std::string::npos);
  }

  TEST_CASE("a device that is not there: exit 4 and which; the other one is served meanwhile") {
    const TwoBench bench;
    write(bench.config,
          "scene = \"t.rtscene\"\n[device]\ndriver = \"sim\"\n[device2]\ndriver = \"reference\"\n"
          "address = \"unix:nobody.sock\"\n");
    const ProgramResult r = bench.run("--seconds 2 --allow-degraded --accept-unbudgeted --json");
    CAPTURE(r.err);
    CHECK(r.exit_code == 4);
    const json summary = lines_of(r.out).back();
    CHECK(summary["why"].get<std::string>().find("device 2: the device was never there") !=
          std::string::npos);
    CHECK(summary["devices"][0]["armings"] >= 1);
    CHECK(summary["devices"][1]["link"]["connects"] == 0);
    CHECK(summary["verdict"]["text"].get<std::string>().find("FAILED: ") == 0);
  }

  TEST_CASE("SIGTERM while both press: ramp to zero on both, exit 0") {
    const TwoBench bench;
    const Ended ended = run_pressed(bench, [](pid_t pid) { signal_process(pid, SIGTERM); });
    CHECK(ended.exit_code == 0);
    REQUIRE_FALSE(ended.lines.empty());
    const json& summary = ended.lines.back();
    REQUIRE(summary["kind"] == "summary");
    for (const json& device : summary["devices"]) {
      CAPTURE(device["ending"].dump());
      CHECK(device["ending"]["force_n"] > 1.0);
      CHECK(device["ending"]["jumps"] == 0);
      CHECK(device["ending"]["last_force_n"] == 0.0);
      if (device["peer"]["watchdog_cuts"] == 0) CHECK(device["peer"]["released"] == 1);
    }
  }

  TEST_CASE("a killed servo process: the spare goes on with both, and each leaves its last ticks") {
    const TwoBench bench;
    write(bench.config, std::string(kTwoHead) + "[recorder]\ncrash_file = \"crash.csv\"\n");
    const Ended ended = run_pressed(bench, [](pid_t pid) {
      kill_servo_of(pid);
      std::this_thread::sleep_for(std::chrono::seconds(5));  // a cycle of the scripted hands
      signal_process(pid, SIGINT);
    });
    CHECK(ended.exit_code == 1);
    REQUIRE_FALSE(ended.lines.empty());
    const json& summary = ended.lines.back();
    REQUIRE(summary["kind"] == "summary");
    CHECK(summary["servo_processes"] == 2);
    for (const json& device : summary["devices"]) CHECK(device["armings"] >= 2);
    for (const char* file : {"crash.csv", "crash-device2.csv"}) {
      const std::string crash = text_of_file(bench.folder.file(file));
      CHECK(crash.find("killed by signal 9") != std::string::npos);
      CHECK(std::count(crash.begin(), crash.end(), '\n') > 100);
    }
  }
}
