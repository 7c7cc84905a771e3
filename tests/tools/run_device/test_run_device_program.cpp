// SPDX-License-Identifier: Apache-2.0
// run_device as a user runs it, on this machine: exit codes, files, streams.
#include <doctest/doctest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "hal/realtime/deploy_text.hpp"
#include "tests/support/program_run.hpp"

using haptic::sim::test::ProgramResult;
using haptic::sim::test::run_program;
using haptic::sim::test::ScratchFolder;
using haptic::sim::test::text_of_file;
using nlohmann::json;

namespace {

ProgramResult doctor(const std::string& arguments) {
  return run_program(HAPTIC_RUN_DEVICE, "doctor " + arguments);
}

// The level of a line; fails where there is none of that name.
std::string level_of(const json& report, const std::string& name) {
  for (const json& line : report["lines"]) {
    if (line["name"] == name) return line["level"];
  }
  FAIL("no line " << name);
  return "";
}

// What the exit code must be by the lines alone.
int code_of(const json& report, bool strict) {
  for (const json& line : report["lines"]) {
    if (line["level"] == "failure") return 4;
    if (strict && line["level"] == "warning" && line["refuses_in_strict"] == true) return 4;
  }
  return 0;
}

}  // namespace

TEST_SUITE("tools.run_device") {
  TEST_CASE("doctor --json: every line has found and fix, and the exit code follows from them") {
    for (const bool strict : {false, true}) {
      CAPTURE(strict);
      const ProgramResult r =
          doctor(std::string("--json --seconds 0.1") + (strict ? " --strict" : ""));
      CHECK(r.err.empty());
      const json report = json::parse(r.out);
      CHECK(report["lines"].size() == 61);
      std::set<std::string> names;
      for (const json& line : report["lines"]) {
        CAPTURE(line["name"].get<std::string>());
        names.insert(line["name"]);
        CHECK_FALSE(line["found"].get<std::string>().empty());
        CHECK_FALSE(line["fix"].get<std::string>().empty());
        const std::string level = line["level"];
        CHECK((level == "pass" || level == "warning" || level == "failure" || level == "skipped"));
      }
      CHECK(names.size() == report["lines"].size());
      CHECK(report["strict"] == strict);
      CHECK(report["fit"] == (r.exit_code == 0));
      CHECK(r.exit_code == code_of(report, strict));
      CHECK(report["wakeups"]["ticks"] > 0);
    }
  }

  TEST_CASE("doctor: what it says of this machine is what its files say") {
    const json report = json::parse(doctor("--json --no-measure").out);
    const bool usb = std::filesystem::exists("/sys/bus/usb/devices/usb1");
    CHECK(level_of(report, "USB controller") == (usb ? "pass" : "warning"));
    const std::string version = text_of_file("/proc/sys/kernel/version");
    const bool real_time = text_of_file("/sys/kernel/realtime") == "1\n" ||
                           version.find("PREEMPT_RT") != std::string::npos;
    CHECK(level_of(report, "PREEMPT_RT") == (real_time ? "pass" : "warning"));
    CHECK(level_of(report, "wake-ups") == "skipped");
    CHECK(level_of(report, "device") == "skipped");
    CHECK(report["wakeups"].is_null());
  }

  TEST_CASE("doctor --device: one that is not there makes the machine unfit for it") {
    // The upper end of the test range; no device may use it.
    const ProgramResult r = doctor("--json --no-measure --device 1209:0010:NOSUCHSERIAL");
    CHECK(r.exit_code == 4);
    const json report = json::parse(r.out);
    CHECK(level_of(report, "device") == "failure");
    CHECK(level_of(report, "device access") == "skipped");
    CHECK(report["fit"] == false);
  }

  TEST_CASE("doctor: the table keeps to 100 columns, commands and file lines apart") {
    const ProgramResult r = doctor("--no-measure --device 1209:0010");
    CHECK(r.exit_code == 4);
    std::istringstream lines(r.out);
    std::string line;
    std::size_t count = 0;
    while (std::getline(lines, line)) {
      count += 1;
      const bool verbatim = line.starts_with("    ") && !line.starts_with("     ");
      CAPTURE(line);
      if (!verbatim) CHECK(line.size() <= 100);
    }
    CHECK(count >= 25);
    CHECK(r.out.find("NOT FIT") != std::string::npos);
  }

  TEST_CASE("doctor --histogram: as many wake-ups in the file as were counted") {
    const ScratchFolder folder("run_device");
    const std::string file = folder.file("h.txt");
    const json report = json::parse(doctor("--json --seconds 0.1 --histogram " + file).out);
    std::istringstream lines(text_of_file(file));
    std::string line;
    std::getline(lines, line);
    CHECK(line == "# Histogram");
    std::uint64_t sum = 0, overflows = 0;
    while (std::getline(lines, line)) {
      std::uint64_t us = 0, count = 0;
      if (!line.starts_with('#') && std::istringstream(line) >> us >> count) sum += count;
      const std::string key = "# Histogram Overflows:";
      if (line.starts_with(key)) overflows = std::stoull(line.substr(key.size()));
    }
    CHECK(sum + overflows == report["wakeups"]["ticks"].get<std::uint64_t>());
    const ProgramResult nowhere = doctor("--seconds 0.1 --histogram /nowhere/at/all/h.txt");
    CHECK(nowhere.exit_code == 4);
    CHECK(nowhere.err.find("/nowhere/at/all") != std::string::npos);
  }

  TEST_CASE("doctor --print: the files to install, and nothing else") {
    for (const haptic::hal::DeployFile& file : haptic::hal::deploy_files()) {
      const ProgramResult r = doctor("--print " + std::string(file.name));
      CHECK(r.exit_code == 0);
      CHECK(r.out == std::string(file.text));
    }
  }

  TEST_CASE("usage errors exit 2") {
    CHECK(run_program(HAPTIC_RUN_DEVICE, "").exit_code == 2);
    for (const char* arguments :
         {"--nonsense", "--device 1209", "--device g:1", "--rate 0", "--rate fast", "--cpu a",
          "--cpu -1", "--cpu 1,2,3", "--print passwd", "--seconds 1 --no-measure", "--seconds nan",
          "--rate nan", "--limit-us -nan"}) {
      CAPTURE(arguments);
      const ProgramResult r = doctor(arguments);
      CHECK(r.exit_code == 2);
      CHECK(r.out.empty());
    }
    CHECK(run_program(HAPTIC_RUN_DEVICE, "run absent.toml --seconds nan").exit_code == 2);
    CHECK(doctor("--help").exit_code == 0);
    CHECK(run_program(HAPTIC_RUN_DEVICE, "--version").exit_code == 0);
  }
}
