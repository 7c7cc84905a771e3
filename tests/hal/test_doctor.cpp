// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <set>

#include "tests/hal/doctor_cases.hpp"
#include "tests/support/fake_machine.hpp"
#include "tests/support/text_search.hpp"

using namespace haptic::hal;
using haptic::test::DoctorCase;
using haptic::test::FakeMachine;
using haptic::test::has;
using haptic::test::kFailure;
using haptic::test::kPass;
using haptic::test::kWarning;

namespace {

void check_case(const DoctorCase& c) {
  CAPTURE(c.what);
  FakeMachine machine;
  REQUIRE(machine.line(c.line).level == kPass);
  c.change(machine);
  const DoctorLine line = machine.line(c.line);
  CHECK(line.level == c.level);
  CHECK(line.refuses_in_strict == c.refuses);
  for (const std::string& word : c.found) {
    CAPTURE(line.found);
    CHECK(has(line.found, word));
  }
  for (const std::string& word : c.fix) {
    CAPTURE(line.fix);
    CHECK(has(line.fix, word));
  }
  const bool fit = c.level != kFailure, fit_in_strict = fit && !c.refuses;
  CHECK(is_fit({line}, false) == fit);
  CHECK(is_fit({line}, true) == fit_in_strict);
}

}  // namespace

TEST_SUITE("hal.doctor") {
  TEST_CASE("examine: a healthy machine passes every line, and asks for what the loop will be") {
    FakeMachine machine;
    machine.questions.period_ns = 250'000;
    const std::vector<DoctorLine> lines = machine.examine();
    CHECK(lines.size() == 61);
    std::set<std::string> names;
    for (const DoctorLine& line : lines) {
      CAPTURE(line.name);
      CAPTURE(line.found);
      CHECK(line.level == kPass);
      CHECK_FALSE(line.found.empty());
      CHECK(line.fix == "none needed");
      names.insert(line.name);
    }
    CHECK(names.size() == lines.size());
    CHECK(is_fit(lines, true));
    CHECK(machine.probes.last_priority == 80);
    CHECK(machine.probes.last_node == "/dev/bus/usb/001/004");
    CHECK(machine.probes.measured == 1);
    CHECK(machine.probes.last_question.period_ns == 250'000);
    CHECK(machine.probes.last_question.cpu == 3);
    CHECK(machine.probes.last_question.priority == 80);
  }

  TEST_CASE("kernel: each defect is seen, with its fix") {
    for (const DoctorCase& c : haptic::test::kernel_cases()) check_case(c);
  }
  TEST_CASE("cores: each defect is seen, with its fix") {
    for (const DoctorCase& c : haptic::test::core_cases()) check_case(c);
  }
  TEST_CASE("housekeeping: each defect is seen, with its fix") {
    for (const DoctorCase& c : haptic::test::housekeeping_cases()) check_case(c);
  }
  TEST_CASE("power: each defect is seen, with its fix") {
    for (const DoctorCase& c : haptic::test::power_cases()) check_case(c);
  }
  TEST_CASE("USB: each defect is seen, with its fix") {
    for (const DoctorCase& c : haptic::test::usb_cases()) check_case(c);
  }
  TEST_CASE("bridges: each defect is seen, with its fix") {
    for (const DoctorCase& c : haptic::test::bridge_cases()) check_case(c);
  }
  TEST_CASE("measured: each defect is seen, with its fix") {
    for (const DoctorCase& c : haptic::test::measured_cases()) check_case(c);
  }

  TEST_CASE("every line has a case in which it does not pass") {
    std::set<std::string> seen;
    const auto note = [&](std::span<const DoctorCase> cases) {
      for (const DoctorCase& c : cases) {
        if (c.level == kWarning || c.level == kFailure) seen.insert(c.line);
      }
    };
    note(haptic::test::kernel_cases());
    note(haptic::test::core_cases());
    note(haptic::test::housekeeping_cases());
    note(haptic::test::power_cases());
    note(haptic::test::usb_cases());
    note(haptic::test::measured_cases());
    note(haptic::test::bridge_cases());
    FakeMachine machine;
    for (const DoctorLine& line : machine.examine()) {
      CAPTURE(line.name);
      CHECK(seen.count(line.name) == 1);
    }
  }

  TEST_CASE("examine: an empty tree gives the same lines, none without found and fix") {
    FakeMachine machine;
    std::vector<std::string> names;
    for (const DoctorLine& line : machine.examine()) names.push_back(line.name);
    machine.remove("/sys");
    machine.remove("/proc");
    std::size_t i = 0;
    for (const DoctorLine& line : machine.examine()) {
      REQUIRE(i < names.size());
      CHECK(line.name == names[i++]);
      CHECK_FALSE(line.found.empty());
      CHECK_FALSE(line.fix.empty());
    }
    CHECK(i == names.size());
  }

  TEST_CASE("late by: rtla is run only where it is there, asked for, and a wake-up was late") {
    FakeMachine machine;
    machine.questions.name_culprit = true;
    CHECK(machine.line("late by").level == kPass);
    CHECK(machine.probes.ran.empty());
    machine.probes.answer.lateness.add(1'200'000);
    machine.probes.said =
        "                                     Timer Latency\n"
        "## CPU 3 hit stop tracing, analyzing it ##\n"
        "  Thread latency: 1200.00 us\n  Blocking thread: kworker/u8:1:77  1100.00 us\n";
    machine.questions.wakeup_limit_ns = 100'000;
    const DoctorLine line = machine.line("late by");
    CHECK(line.level == kWarning);
    CHECK(has(line.found, "kworker/u8:1:77"));
    CHECK_FALSE(has(line.found, "Timer Latency"));
    CHECK(machine.probes.ran == std::vector<std::string>{"rtla", "timerlat", "top", "-q", "-d",
                                                         "30s", "-T", "100", "-s", "100", "-c",
                                                         "3"});
    machine.probes.ran.clear();
    machine.questions.name_culprit = false;
    CHECK(has(machine.line("late by").fix, "run_device doctor --culprit"));
    machine.questions.name_culprit = true;
    machine.probes.program = "";
    CHECK(has(machine.line("late by").fix, "apt-get install rtla"));
    CHECK(machine.probes.ran.empty());
  }
}
