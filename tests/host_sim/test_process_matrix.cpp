// SPDX-License-Identifier: Apache-2.0
// run_device under every fault of its processes, with force on; and that the judge would notice.
#include <doctest/doctest.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/lab/processes/process_judge.hpp"
#include "host_sim/lab/processes/process_matrix.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {
namespace {

constexpr double kSlew_n_per_s = 2000;

std::string failures_of(const std::vector<ProcessVerdict>& verdicts) {
  std::string text;
  for (const ProcessVerdict& v : verdicts) {
    for (const std::string& failure : v.failures)
      text += std::string(to_text(v.cell.fault->victim)) + ", " + v.cell.fault->name + ", " +
              to_text(v.cell.state) + ": " + failure + "\n" + v.said.substr(0, 4000) + "\n";
  }
  return text;
}

const ProcessFault& fault_named(ProcessVictim victim, const std::string& name) {
  for (const ProcessFault& fault : process_faults()) {
    if (fault.victim == victim && name == fault.name) return fault;
  }
  FAIL("no such fault: " << name);
  return process_faults().front();
}

/// A run as the device would have seen it: 10 N, then `after` from the fault on, one each
/// millisecond.
ProcessVerdict wire_of(const ProcessFault& fault, const std::vector<double>& after) {
  ProcessVerdict v;
  v.cell = {OperatorState::kArmedContact, &fault};
  v.fault_ns = 100'000'000;
  v.found.before_n = 10;
  v.found.after_n = after.back();
  std::int64_t now = 90'000'000;
  const auto add = [&](double force_n) {
    WireCommand command;
    command.stamp_ns = now;
    command.wrench.force_w = {0, 0, force_n};
    command.drives_on = true;
    command.host = 1;
    v.wire.commands.push_back(command);
    v.wire.periods.push_back({now, 0, force_n, true, 0});
    now += 1'000'000;
  };
  while (now < v.fault_ns) add(10);
  for (const double force_n : after) add(force_n);
  judge_wire(v, kSlew_n_per_s);
  return v;
}

std::vector<double> ramp(double step_n, std::size_t periods) {
  std::vector<double> forces;
  for (double force_n = 10; forces.size() < periods; force_n -= step_n)
    forces.push_back(force_n > 0 ? force_n : 0);
  return forces;
}

}  // namespace

TEST_SUITE("host_sim.process_matrix") {
  TEST_CASE("a fault of each process with force on: what the device was handed") {
    // One of each way to fail and to be noticed, some four seconds each; all faults are in the long
    // form.
    const std::vector<std::pair<ProcessVictim, std::string>> chosen = {
        {ProcessVictim::kServo, "SIGKILL"},
        {ProcessVictim::kServo, "SIGSTOP"},
        {ProcessVictim::kServo, "scribbles 0x41"},
        {ProcessVictim::kServoAndSpare, "SIGSTOP"},
        {ProcessVictim::kGuardian, "SIGKILL"},
        {ProcessVictim::kGuardian, "SIGSTOP"},
        {ProcessVictim::kZeroKeeper, "SIGKILL"},
        {ProcessVictim::kTerminal, "closed"},
        {ProcessVictim::kSecondDevice, "takes its place"},
        {ProcessVictim::kDevice, "deaf for 5 ms"},
        {ProcessVictim::kDevice, "deaf for 300 ms"},
        {ProcessVictim::kDevice, "deaf for 450 ms while the guardian gets SIGKILL"},
        {ProcessVictim::kBridge, "SIGKILL"},
        {ProcessVictim::kBridge, "stopped for 1000 ms"},
        {ProcessVictim::kBridge, "scribbles 0x41"},
        {ProcessVictim::kLogReader, "stops reading, then SIGTERM"}};
    ProcessMatrixOptions options;
    options.quick = true;
    options.program = HAPTIC_RUN_DEVICE;
    options.wanted = [&chosen](const ProcessCase& cell) {
      return std::any_of(chosen.begin(), chosen.end(), [&](const auto& each) {
        return each.first == cell.fault->victim && each.second == cell.fault->name;
      });
    };
    const std::vector<ProcessVerdict> verdicts = run_process_matrix(options);
    CHECK(verdicts.size() == chosen.size());
    CHECK(failures_of(verdicts) == "");
    const std::vector<OutputText> files = process_files(verdicts);
    REQUIRE(files.size() == 3);
    CHECK(files[1].content.find("FAILS") == std::string::npos);
  }

  TEST_CASE("[long] every fault of every process in every state") {
    ProcessMatrixOptions options;
    options.program = HAPTIC_RUN_DEVICE;
    const std::vector<ProcessVerdict> verdicts = run_process_matrix(options);
    CHECK(verdicts.size() ==
          process_faults().size() * static_cast<std::size_t>(OperatorState::kCount));
    CHECK(failures_of(verdicts) == "");
    options.bridged = true;
    CHECK(failures_of(run_process_matrix(options)) == "");
  }

  TEST_CASE("[long] probe: a queue in front of the device is found") {
    ProcessMatrixOptions options;
    options.program = HAPTIC_RUN_DEVICE;
    options.quick = true;
    options.wanted = [](const ProcessCase& cell) {
      return cell.fault->victim == ProcessVictim::kGuardian && cell.fault->number == SIGTERM;
    };
    options.stale_ms = 20;
    CHECK(failures_of(run_process_matrix(options)).find("older than two periods") !=
          std::string::npos);
  }

  TEST_CASE("README.md of hal: its table of processes is the matrix's") {
    std::ifstream file(HAPTIC_TEST_DIR "/../hal/README.md");
    const std::string page{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    CHECK(page.find(process_semantics()) != std::string::npos);
    if (page.find(process_semantics()) == std::string::npos) MESSAGE(process_semantics());
  }

  TEST_CASE("the judge holds a ramp for good, and nothing that is worse") {
    const ProcessFault& killed = fault_named(ProcessVictim::kServo, "SIGKILL");
    CHECK(wire_of(killed, ramp(2, 300)).failures.empty());
    // Five newtons at once; a ramp of half a second; one that turns round; none.
    CHECK_FALSE(wire_of(killed, ramp(5, 300)).failures.empty());
    CHECK_FALSE(wire_of(killed, ramp(0.02, 600)).failures.empty());
    std::vector<double> up = ramp(2, 300);
    up[3] = 7;
    CHECK_FALSE(wire_of(killed, up).failures.empty());
    CHECK_FALSE(wire_of(killed, std::vector<double>(600, 10)).failures.empty());
  }

  TEST_CASE("the judge dates each command that changes the force, and no other") {
    const ProcessFault& killed = fault_named(ProcessVictim::kServo, "SIGKILL");
    const auto with_delay = [&](std::int64_t delay_ns) {
      ProcessVerdict v = wire_of(killed, ramp(2, 300));
      for (const WireCommand& c : v.wire.commands)
        v.tapped.push_back({c.stamp_ns - delay_ns, c.wrench});
      v.failures.clear();
      v.found = {};
      v.found.before_n = 10;
      judge_wire(v, kSlew_n_per_s);
      return v;
    };
    const ProcessVerdict fresh = with_delay(1'900'000);
    CHECK(fresh.failures.empty());
    CHECK(fresh.found.dated == 5);  // 10, 8, 6, 4, 2 N; one that is held, and zero, have no age
    CHECK(fresh.found.oldest_ms == doctest::Approx(1.9));
    const ProcessVerdict old = with_delay(2'500'000);
    CHECK(old.found.too_old == 5);
    CHECK_FALSE(old.failures.empty());
  }

  TEST_CASE("the judge: a status may state too much, and too little by one command at most") {
    const ProcessFault& spare = fault_named(ProcessVictim::kSpare, "SIGKILL");
    const auto stating = [&](double force_n) {
      ProcessVerdict v = wire_of(spare, std::vector<double>(600, 10));
      v.stated = {{v.fault_ns + 50'000'000, force_n}};
      v.failures.clear();
      judge_wire(v, kSlew_n_per_s);
      return v;
    };
    CHECK(stating(12).failures.empty());
    CHECK(stating(10).failures.empty());
    CHECK(stating(10).found.stated == 1);
    CHECK_FALSE(stating(0).failures.empty());
    CHECK(stating(9.5).found.understated_n == doctest::Approx(0.5));
  }

  TEST_CASE("the judge: who goes on keeps its force, who is gone has none at once") {
    const ProcessFault& spare = fault_named(ProcessVictim::kSpare, "SIGKILL");
    CHECK(wire_of(spare, std::vector<double>(600, 10)).failures.empty());
    CHECK_FALSE(wire_of(spare, ramp(2, 300)).failures.empty());
    const ProcessFault& gone = fault_named(ProcessVictim::kGuardian, "SIGKILL");
    CHECK(wire_of(gone, std::vector<double>(300, 0)).failures.empty());
    CHECK_FALSE(wire_of(gone, std::vector<double>(600, 10)).failures.empty());
    const ProcessFault& wild = fault_named(ProcessVictim::kServo, "scribbles 0x41");
    CHECK(wire_of(wild, std::vector<double>(300, 10)).failures.empty());
    CHECK_FALSE(wire_of(wild, {10, 14, 18, 22, 26}).failures.empty());
  }
}

}  // namespace haptic::sim
