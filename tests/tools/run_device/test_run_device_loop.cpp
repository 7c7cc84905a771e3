// SPDX-License-Identifier: Apache-2.0
// `run_device run` as a user runs it, with the handle in its own process: exit codes, account and
// messages. The machine may be busy with other things: how many ticks come is only bounded from
// below, generously.
#include <doctest/doctest.h>

#include <unistd.h>
#include <algorithm>

#include <filesystem>

#include "tests/tools/run_device/run_bench.hpp"

using haptic::sim::test::ProgramResult;
using haptic::sim::test::run_program;
using namespace haptic::tools::test;
using nlohmann::json;

namespace {

void check_message(const ProgramResult& r, int line, const std::string& part) {
  CHECK(r.exit_code == 3);
  CAPTURE(r.err);
  CHECK(r.out.empty());
  CHECK(r.err.find("run.toml:" + std::to_string(line) + ":") != std::string::npos);
  CHECK(r.err.find(part) != std::string::npos);
  CHECK(r.err.find("; ") != std::string::npos);  // a fix
}

}  // namespace

TEST_SUITE("tools.run_device.loop") {
  TEST_CASE("two seconds: ticks, reports and outputs of both clockings, one account") {
    const Bench bench;
    for (const char* clocking : {"timer", "report"}) {
      CAPTURE(clocking);
      bench.clock(clocking);
      const ProgramResult r = bench.run_in_time("--seconds 2 --json --status-every 0.5");
      CAPTURE(r.err);
      CHECK(r.exit_code == 0);
      const std::vector<json> lines = lines_of(r.out);
      REQUIRE(lines.size() >= 2);
      std::vector<std::string> events;
      for (std::size_t k = 0; k + 1 < lines.size(); ++k) {
        const bool event = lines[k]["kind"] == "event";
        CHECK((event || lines[k]["kind"] == "status"));
        if (event) events.push_back(lines[k]["event"]);
      }
      // When it happened, and for people on standard error too.
      REQUIRE(events.size() >= 3);
      CHECK(events[0] == "connected");
      CHECK(std::count(events.begin(), events.end(), "armed") >= 1);
      CHECK(r.err.find("the device reports") != std::string::npos);
      const json& summary = lines.back();
      CHECK(summary["kind"] == "summary");
      CHECK(summary["seconds"] >= 2.0);
      const std::uint64_t ticks = summary["ticks"];
      CHECK(ticks >= 500);  // half of those that are due
      std::uint64_t by_degree = 0;
      for (const auto& [name, count] : summary["late"].items())
        by_degree += count.get<std::uint64_t>();
      CHECK(by_degree == ticks);
      CHECK(summary["wakeups"]["count"] == ticks);
      CHECK(summary["link"]["connects"] == 1);
      CHECK(summary["link"]["states"] == summary["link"]["reports"]);
      CHECK(summary["link"]["sent"] == summary["peer"]["commands"]);
      CHECK(summary["peer"]["refused"] == 0);
      CHECK(summary["armings"] >= 1);
      CHECK(summary["heap_grown_bytes"] == 0);
      CHECK(summary["ending"]["last_force_n"] == 0.0);
    }
  }

  TEST_CASE("--ticks: counted and timed are as many, from the first armed one on") {
    const Bench bench;
    for (const char* clocking : {"timer", "report"}) {
      CAPTURE(clocking);
      bench.clock(clocking);
      const ProgramResult r = bench.run("--ticks 400 --seconds 60 --json");
      CAPTURE(r.err);
      CHECK(r.exit_code == 0);
      const json summary = lines_of(r.out).back();
      CHECK(summary["why"] == "the ticks asked for are done");
      CHECK(summary["ticks"] == 400);
      CHECK(summary["armed_ticks"] > 0);
      for (const char* name : {"wakeups", "tick"}) CHECK(summary[name]["count"] == 400);
      for (const char* name : {"report_jitter", "send_jitter", "answer"})
        CHECK(summary[name]["count"] > 0);
      for (const char* name : {"wakeups", "tick", "report_jitter", "send_jitter", "answer"}) {
        CAPTURE(name);
        const json& times = summary[name];
        CHECK(times["p50_ns"] <= times["p99_ns"]);
        CHECK(times["p99_ns"] <= times["p99_9_ns"]);
        CHECK(times["p99_9_ns"] <= times["largest_ns"]);
        CHECK(times["sum_ns"] >= times["largest_ns"]);
        std::uint64_t in_classes = 0;
        for (const json& each : times["histogram"])
          in_classes += each["count"].get<std::uint64_t>();
        CHECK(times["count"] == in_classes);
      }
      CHECK(summary["tick"]["p50_ns"] > 0);
    }
  }

  TEST_CASE("without offset_m the part begins where the scene starts: armed, and no fault") {
    const Bench bench;
    write(bench.config, kHead);  // as in the README
    const ProgramResult r = bench.run_in_time("--seconds 2.5 --json");
    CAPTURE(r.err);
    CHECK(r.exit_code == 0);
    bool begun = false;
    double armed_s = 1e9;
    for (const json& line : lines_of(r.out)) {
      if (line["kind"] != "event") continue;
      CHECK(line["text"].get<std::string>().find("starts inside") == std::string::npos);
      if (line["event"] == "begun") {
        begun = true;
        CHECK(line["text"].get<std::string>().find("[workspace] offset_m = [") !=
              std::string::npos);
      }
      if (line["event"] == "armed") armed_s = std::min(armed_s, line["t_s"].get<double>());
    }
    CHECK(begun);
    CHECK(armed_s < 2.0);
    CHECK(lines_of(r.out).back()["waits_for"].is_string());
  }

  TEST_CASE("the simulated hand presses as far as the part has to go: it touches, and exit 0") {
    const Bench bench;
    write(bench.config, kHead);  // the part has 42 mm to go: a hand of 30 mm meets nothing
    const ProgramResult r = bench.run_in_time("--seconds 4 --json");
    CAPTURE(r.err);
    CHECK(r.exit_code == 0);
    const json summary = lines_of(r.out).back();
    CHECK(summary["verdict"]["outcome"] == "followed");
    CHECK(summary["contact_ticks"] > 500);
  }

  TEST_CASE("a place inside: a fault with the keys that give the scene's start") {
    const Bench bench;
    write(bench.config, std::string(kHead) + "[workspace]\noffset_m = [0.0, 0.0, 0.005]\n");
    const ProgramResult r = bench.run("--seconds 0.5 --json");
    CAPTURE(r.err);
    CHECK(r.exit_code == 0);
    CHECK(r.err.find("the part starts inside an obstacle; give [workspace] offset_m = [") !=
          std::string::npos);
    CHECK(r.err.find("then release and press the deadman switch") != std::string::npos);
  }

  TEST_CASE("armed, and too fast for any force: said, and not where there is force") {
    const Bench bench;
    const std::string words = "armed, and no force: the handle moves";
    CHECK(bench.run("--seconds 3").err.find(words) == std::string::npos);
    write(bench.config,
          std::string(kHead) + kWorkspace +
              "[limits]\nfull_speed_m_per_s = 0.00001\nzero_speed_m_per_s = 0.00002\n");
    const ProgramResult r = bench.run_in_time("--seconds 4");
    CAPTURE(r.err);
    CHECK(r.err.find(words) != std::string::npos);
  }

  TEST_CASE("--ticks that --seconds are too short for: exit 1") {
    const Bench bench;
    const ProgramResult r = bench.run("--ticks 1000000 --seconds 1 --json");
    CHECK(r.exit_code == 1);
    const json summary = lines_of(r.out).back();
    CHECK(summary["why"].get<std::string>().find("are not done") != std::string::npos);
    CHECK(summary["ticks"] < 1'000'000);
    CHECK(bench.run("--ticks 0").exit_code == 2);
  }

  TEST_CASE("without --json: a summary for people; `run` is what is done with a configuration") {
    const Bench bench;
    const ProgramResult r = run_program(HAPTIC_RUN_DEVICE, "'" + bench.config + "' --seconds 0.2");
    CHECK(r.exit_code == 0);
    for (const char* part :
         {"ticks", "wake-ups", "tick  ", "answer", "link", "faults", "the time asked for is over"})
      CHECK(r.out.find(part) != std::string::npos);
  }

  TEST_CASE("configuration errors exit 3, with line, defect and fix") {
    const Bench bench;
    struct Row {
      int line;
      const char* text;
      const char* part;
    };
    const Row rows[] = {
        {4, "[lop]\n", "did you mean 'loop'?"},
        {5, "[loop]\nrate_hz = 5\n", "from 50 to 10000"},
        {5, "[loop]\nclocking = \"bus\"\n", "\"timer\" or \"report\""},
        {6, "[loop]\nservo_priority = 70\nusb_priority = 71\n", "above servo_priority"},
        {5, "[loop]\nlock_memory = 1\n", "give true or false"},
        {5, "[workspace]\nscale = 0\n", "scale"},
        {5, "[workspace]\noffset_m = [1, 2]\n", "give three numbers"},
        {5, "[workspace]\nrotation = { w = 2, x = 0, y = 0, z = 0 }\n", "has length 2"},
        {5, "[limits]\nmax_force_n = 13\n", "beyond the 12 of the device"},
        {5, "[limits]\nmax_force_n = 0\n", "is 0, which would not be"},
        {5, "[limits]\nslew_n_per_s = 0\n", "is 0, which would not be"},
        {6, "[limits]\nslew_n_per_s = 100\nslew_nm_per_s = 41\n", "beyond the 40 of the device"},
        {5, "[limits]\njump_speed_m_per_s = 11\n", "beyond the 10 of the device"},
        {5, "[limits]\njump_turn_rad_per_s = 0\n", "is 0, which would not be"},
        {5, "[limits]\nramp_in_s = 0.06\n", "shorter than the 0.1 of the device"},
        {5, "[limits]\nramp_in_s = 11\n", "ramp_in_s"},
        {5, "[workspace]\nhandle_offset_m = [0, 0, 2]\n", "handle_offset_m"},
        {5, "[limits]\nzero_speed_m_per_s = 0.5\n", "not above full_speed_m_per_s"},
        {5, "[switches]\ndeadman = 0\n", "nothing would ever arm"},
        {6, "[switches]\ndeadman = 2\nclutch = 2\n", "shares a switch"},
        {6, "[switches]\ndeadman = 1\nemergency_stop = 5\n", "shares a switch with deadman or"},
        {5, "[recorder]\nflight_seconds = 0\n", "flight_seconds"},
        {5, "[loop]\nrate_hz = \n", "TOML"}};
    for (const Row& row : rows) {
      CAPTURE(row.text);
      write(bench.config, std::string(kHead) + row.text);
      check_message(bench.run("--seconds 1"), row.line, row.part);
    }
    write(bench.config, "scene = \"t.rtscene\"\n[device]\ndriver = \"joystick\"\n");
    check_message(bench.run("--seconds 1"), 3, "the drivers are");
    write(bench.config,
          "scene = \"t.rtscene\"\n[device]\ndriver = \"reference\"\naddress = \"x\"\n");
    check_message(bench.run("--seconds 1"), 4, "VID:PID");
    write(bench.config,
          "scene = \"t.rtscene\"\n[device]\ndriver = \"reference\"\nfirmware = \"x\"\n");
    check_message(bench.run("--seconds 1"), 4, "is a key of driver 'falcon' and of no other");
    write(bench.config,
          "scene = \"t.rtscene\"\n[device]\ndriver = \"falcon\"\nfirmware = \"x\"\n"
          "firmware_sha256 = \"12\"\n");
    check_message(bench.run("--seconds 1"), 5, "'12' is no SHA-256");
    write(bench.config, "scene = \"other.rtscene\"\n[device]\ndriver = \"sim\"\n");
    check_message(bench.run("--seconds 1"), 1, "no file 'other.rtscene'");
    write(bench.config, "scene = \"run.toml\"\n[device]\ndriver = \"sim\"\n");
    const ProgramResult r = bench.run("--seconds 1");
    CHECK(r.exit_code == 3);
    CHECK(r.err.find("not a usable scene") != std::string::npos);
    CHECK(run_program(HAPTIC_RUN_DEVICE, "run /nowhere/run.toml").exit_code == 3);
  }

  TEST_CASE("a scene of a simplified part: one line on standard error names it") {
    const Bench bench;
    const std::string part = bench.folder.file("part.obj"), scene = bench.folder.file("part.toml");
    write(part,
          "v .1 0 0\nv 3 0 0\nv 3 2 0\nv 0 2 0\nv 0 .1 0\nv .1 0 1\nv 3 0 1\nv 3 2 1\nv 0 2 1\n"
          "v 0 .1 1\nf 5 4 3 2 1\nf 6 7 8 9 10\nf 1 2 7 6\nf 2 3 8 7\nf 3 4 9 8\nf 4 5 10 9\n"
          "f 5 1 6 10\n");
    write(scene,
          "format = 1\nname = \"s\"\n[moving]\nmesh = \"part.obj\"\nscale_to_m = 0.01\n"
          "position_m = [0, 0, 0.1]\n[[static]]\nmesh = \"part.obj\"\nscale_to_m = 0.01\n"
          "simplify_m = 0.001\n[rendering]\nk_f_n_per_m = 500\n");
    REQUIRE(run_program(HAPTIC_GRAPH_COMPILER,
                        "'" + scene + "' -o '" + bench.folder.file("t.rtscene") + "'")
                .exit_code == 0);
    const std::string err = bench.run("--seconds 0.3 --json").err;
    CAPTURE(err);
    const std::string said = "'part.obj' was simplified: the surface is up to 0.000707 m from";
    CHECK(err.find("run_device: warning: ") != std::string::npos);
    CHECK(err.find(said) != std::string::npos);
    CHECK(err.find(said) == err.rfind(said));
  }

  TEST_CASE("--device takes the place of the file's driver; usage errors exit 2") {
    const Bench bench;
    write(bench.config, "scene = \"t.rtscene\"\n[device]\ndriver = \"falcon\"\n");
    const ProgramResult r = bench.run("--device sim --seconds 0.2 --json");
    CHECK(r.exit_code == 0);
    CHECK(lines_of(r.out).back()["driver"] == "sim");
    CHECK(bench.run("--device joystick").exit_code == 2);
    CHECK(bench.run("--seconds 0").exit_code == 2);
    CHECK(run_program(HAPTIC_RUN_DEVICE, "run").exit_code == 2);
    CHECK(run_program(HAPTIC_RUN_DEVICE, "run --help").exit_code == 0);
  }

  TEST_CASE("a device that is not there is waited for, reported, and exit 4 when time is over") {
    const Bench bench;
    // The upper end of the test range; no device may use it.
    write(bench.config,
          "scene = \"t.rtscene\"\n[device]\ndriver = \"reference\"\n"
          "address = \"1209:0010:NOSUCHSERIAL\"\n");
    const ProgramResult r = bench.run("--seconds 0.3 --allow-degraded --json");
    CHECK(r.exit_code == 4);
    const json summary = lines_of(r.out).back();
    CHECK(summary["link"]["connects"] == 0);
    CHECK(summary["trouble"].get<std::string>().find("1209:0010") != std::string::npos);
    CHECK(summary["ticks"] > 0);
    CHECK(summary["largest_force_n"] == 0.0);
  }

  TEST_CASE("a device with motors: strict by default, and what it finds of the machine is said") {
    const Bench bench;
    const std::string head =
        "scene = \"t.rtscene\"\n[device]\ndriver = \"reference\"\n"
        "address = \"1209:0010:NOSUCHSERIAL\"\n[loop]\nservo_cpu = 1023\n";
    write(bench.config, head);  // a core that is not there is not granted
    ProgramResult r = bench.run("--seconds 0.3 --json");
    CHECK(r.exit_code == 4);
    CHECK(r.err.find("--allow-degraded") != std::string::npos);
    json summary = lines_of(r.out).back();
    CHECK(summary["refused"] == true);
    CHECK(summary["why"].get<std::string>().find("--allow-degraded") != std::string::npos);
    CHECK(summary["trouble"] == "");  // no device was looked for
    for (const bool option : {true, false}) {
      CAPTURE(option);
      write(bench.config, head + (option ? "" : "strict = false\n"));
      r = bench.run(std::string("--seconds 0.3 --json") + (option ? " --allow-degraded" : ""));
      summary = lines_of(r.out).back();
      CHECK(summary["refused"] == false);
      CHECK(summary["force_share"] <= 0.5);
      CHECK(summary["trouble"] != "");
      CHECK(r.out.find("wake-ups: p99.9") != std::string::npos);
      CHECK(r.out.find("force and torque are lowered to") != std::string::npos);
    }
    // The link's thread counts too.
    write(bench.config, head.substr(0, head.find("servo_cpu")) + "usb_cpu = 1023\n");
    r = bench.run("--seconds 0.3 --json --allow-degraded");
    CHECK(lines_of(r.out).back()["force_share"] <= 0.5);
    // Without motors nothing is measured, and nothing refused.
    write(bench.config, std::string(kHead) + "[loop]\nservo_cpu = 1023\n");
    r = bench.run("--seconds 0.3 --json");
    CHECK(r.exit_code == 0);
    CHECK(r.out.find("wake-ups: ") == std::string::npos);
    CHECK(lines_of(r.out).back()["force_share"] == 1.0);
  }

  TEST_CASE("a core that is not there: reported and gone on without, or with strict exit 4") {
    const Bench bench;
    for (const bool strict : {false, true}) {
      CAPTURE(strict);
      write(bench.config, std::string(kHead) + kWorkspace + "[loop]\nservo_cpu = 1023\nstrict = " +
                              (strict ? "true" : "false") + "\n");
      const ProgramResult r = bench.run("--seconds 0.2 --json");
      CHECK(r.exit_code == (strict ? 4 : 0));
      CHECK(r.err.find("servo thread: core affinity: EINVAL") != std::string::npos);
      CHECK(r.err.find("Mend: ") != std::string::npos);
      const json summary = lines_of(r.out).back();
      CHECK(summary["refused"] == strict);
      CHECK_FALSE(summary["refusals"].empty());
      CHECK((summary["link"]["connects"] == 0) == strict);
    }
  }

  TEST_CASE("an ordinary user: degraded, or with strict exit 4") {
    const bool root = geteuid() == 0;
    const bool can_drop = root && run_program("setpriv", "--version").exit_code == 0;
    if (root && !can_drop) {
      MESSAGE("skipped: root, and there is no setpriv to become an ordinary user with");
      return;
    }
    const Bench bench;
    std::filesystem::permissions(std::filesystem::path(bench.config).parent_path(),
                                 std::filesystem::perms::all);
    for (const bool strict : {false, true}) {
      write(bench.config, std::string(kHead) + kWorkspace +
                              "[loop]\nstrict = " + (strict ? "true" : "false") + "\n");
      const std::string program = std::string("'") + HAPTIC_RUN_DEVICE + "' run '" + bench.config +
                                  "' --seconds 0.2 --json";
      // No right to any real-time priority, with any limits of this session.
      const std::string command = "--reuid=65534 --regid=65534 --clear-groups --inh-caps=-all " +
                                  std::string("prlimit --rtprio=0:0 ") + program;
      const ProgramResult r = root ? run_program("setpriv", command)
                                   : run_program("prlimit", "--rtprio=0:0 " + program);
      if (r.exit_code == 126 || r.exit_code == 127) {
        MESSAGE("skipped: another user cannot run the program: " << r.err);
        return;
      }
      CHECK(r.exit_code == (strict ? 4 : 0));
      CHECK(r.err.find("servo thread: SCHED_FIFO priority: EPERM") != std::string::npos);
      CHECK(r.err.find(strict ? "refused" : "degraded") != std::string::npos);
    }
  }
}
