// SPDX-License-Identifier: Apache-2.0
// Every fault in every state, by its stated failure semantics; and that the check would notice.
#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <string>

#include "host_sim/lab/faults/fault_matrix.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr unsigned kThreads = 2;

std::string failures_of(const std::vector<FaultVerdict>& verdicts) {
  std::string text;
  for (const FaultVerdict& v : verdicts) {
    for (const std::string& failure : v.failures)
      text +=
          std::string(v.cell.fault->name) + ", " + to_text(v.cell.state) + ": " + failure + "\n";
  }
  return text;
}

/// Cells of the state armed in contact, for these faults.
FaultMatrixOptions pressed(std::set<std::string> names) {
  FaultMatrixOptions options;
  options.wanted = [names = std::move(names)](const FaultCase& cell) {
    return cell.state == FaultState::kArmedContact && names.count(cell.fault->name) != 0;
  };
  return options;
}

bool some_failure_says(const FaultVerdict& verdict, const std::string& words) {
  return std::any_of(verdict.failures.begin(), verdict.failures.end(),
                     [&](const std::string& f) { return f.find(words) != std::string::npos; });
}

std::string text_of(const std::string& path) {
  std::ifstream file(path);
  REQUIRE(file.good());
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// Cells of a Markdown table row, trimmed; empty for another line.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  if (line.empty() || line.front() != '|') return cells;
  std::istringstream stream(line.substr(1));
  for (std::string cell; std::getline(stream, cell, '|');) {
    const std::size_t begin = cell.find_first_not_of(' ');
    if (begin == std::string::npos) continue;
    cells.push_back(cell.substr(begin, cell.find_last_not_of(' ') + 1 - begin));
  }
  return cells;
}

}  // namespace

TEST_SUITE("host_sim.fault_matrix") {
  TEST_CASE("through libusb: every fault in every state ends as stated") {
    FaultMatrixOptions options;
    options.threads = kThreads;
    const std::vector<FaultVerdict> verdicts = run_fault_matrix(options);
    CHECK(verdicts.size() == faults().size() * static_cast<std::size_t>(FaultState::kCount));
    CHECK(failures_of(verdicts) == "");
    CHECK(all_hold(verdicts));

    // Full force is what the state says, and the limits were reached, not only kept.
    double send = 0, least_n = 1e9;
    for (const FaultVerdict& v : verdicts) {
      send = std::max(send, v.found.send_share);
      if (v.cell.state == FaultState::kArmedContact)
        least_n = std::min(least_n, v.found.acting_before_n);
    }
    CHECK(send > 0.99);
    CHECK(least_n > 0.8 * 12);
  }

  TEST_CASE("through libusb, clocked by reports: the same where there is force") {
    FaultMatrixOptions options;
    options.quick = true;
    options.threads = kThreads;
    options.run.report_clocked = true;
    CHECK(failures_of(run_fault_matrix(options)) == "");
  }

  TEST_CASE("without a bus: the faults of device and servo loop end as stated") {
    FaultMatrixOptions options;
    options.threads = kThreads;
    options.run.carrier = StackCarrier::kDirect;
    const std::vector<FaultVerdict> verdicts = run_fault_matrix(options);
    CHECK(verdicts.size() > 100);
    CHECK(failures_of(verdicts) == "");
  }

  TEST_CASE("equal runs are equal to the byte, on any number of threads") {
    FaultMatrixOptions options = pressed({"none", "unplug in flight", "corrupt 10", "lost 3"});
    const std::vector<OutputText> one = fault_files(run_fault_matrix(options), options);
    options.threads = kThreads;
    const std::vector<OutputText> two = fault_files(run_fault_matrix(options), options);
    REQUIRE(one.size() == two.size());
    for (std::size_t k = 0; k < one.size(); ++k) CHECK(one[k].content == two[k].content);
  }

  TEST_CASE("unplugged at full force: what was handed over, and the first reports after it") {
    const std::vector<FaultVerdict> verdicts = run_fault_matrix(pressed({"unplug in flight"}));
    REQUIRE(verdicts.size() == 1);
    const FaultTrace& t = verdicts[0].trace;
    CHECK(verdicts[0].found.handed_before_n > 0.8 * 12);
    CHECK(verdicts[0].found.largest_n <= 12.0001);
    unsigned sends_away = 0, sends_before_arming = 0;
    for (std::size_t k = t.injected; k < t.cleared; ++k)
      sends_away += static_cast<unsigned>(t.samples[k].sent.size());
    for (std::size_t k = t.cleared; k < t.pressed; ++k) {
      for (const StackSend& send : t.samples[k].sent) {
        ++sends_before_arming;
        CHECK(send.wrench.force_w.isZero(0));
        CHECK(send.wrench.torque_w.isZero(0));
      }
    }
    CHECK(sends_away <= 1);
    CHECK(sends_before_arming > 100);
    CHECK(verdicts[0].found.ramp_in_s >= 0.05);
    CHECK(verdicts[0].found.recovered_n > 1.0);
  }

  TEST_CASE("probe: a stack with another slew limit is noticed") {
    for (const double factor : {10.0, 1.02}) {
      FaultMatrixOptions options = pressed({"emergency stop by call"});
      options.run.slew_factor = factor;
      const std::vector<FaultVerdict> verdicts = run_fault_matrix(options);
      REQUIRE(verdicts.size() == 1);
      CHECK(some_failure_says(verdicts[0], "a command changes by"));
      CHECK(some_failure_says(verdicts[0], "the device's wrench changes by"));
    }
    FaultMatrixOptions slow = pressed({"emergency stop by call"});
    slow.run.slew_factor = 0.6;  // lower, and the force would be lowered with it
    CHECK(some_failure_says(run_fault_matrix(slow).at(0), "zero after"));
  }

  TEST_CASE("probe: a ramp in that is too short is noticed") {
    FaultMatrixOptions options = pressed({"emergency stop by call"});
    options.run.ramp_in_factor = 0.5;
    CHECK(some_failure_says(run_fault_matrix(options).at(0), "ramp in of"));
  }

  TEST_CASE("probe: a fault that is not the one stated is noticed") {
    // The run of one fault judged by the rule of another.
    const std::vector<std::byte> scene = fault_scene();
    const FaultSettings settings;
    const auto run = [&](const char* name) {
      return run_fault(scene, {FaultState::kArmedContact, &stack_fault_named(name)}, settings);
    };
    const FaultTrace unharmed = run("none");
    const auto judged = [&](const char* said, const char* done) {
      return judge_fault({FaultState::kArmedContact, &stack_fault_named(said)}, run(done), unharmed,
                         settings);
    };
    CHECK(judged("lost 1", "lost 1").failures.empty());
    const FaultVerdict felt = judged("lost 1", "lost 50");
    CHECK(some_failure_says(felt, "latched"));
    CHECK(some_failure_says(felt, "reported"));
    CHECK(some_failure_says(felt, "without the fault"));
    CHECK(some_failure_says(judged("lost 50", "lost 1"), "zero after"));
    CHECK(some_failure_says(judged("overheated", "drive fault"), "cuts by the device"));
    CHECK(some_failure_says(judged("device deaf", "overheated"), "cuts by the device"));
  }

  TEST_CASE("two hands: a fault at the device of one leaves the other as it is") {
    for (const StackCarrier carrier : {StackCarrier::kUsb, StackCarrier::kDirect}) {
      FaultMatrixOptions options;
      options.run.hands = 2;
      options.run.carrier = carrier;
      options.threads = kThreads;
      options.wanted = [](const FaultCase& cell) {
        return cell.state == FaultState::kArmedContact;
      };
      const std::vector<FaultVerdict> verdicts = run_fault_matrix(options);
      CHECK(verdicts.size() >= 2 * 10);
      CHECK(failures_of(verdicts) == "");
      for (const FaultVerdict& v : verdicts)
        if (v.trace.others.size() != v.trace.samples.size()) FAIL("the other hand was not seen");
    }
  }

  TEST_CASE("[long] two hands: every fault in every state at each device") {
    FaultMatrixOptions options;
    options.run.hands = 2;
    options.threads = kThreads;
    const std::vector<FaultVerdict> verdicts = run_fault_matrix(options);
    MESSAGE(verdicts.size(), " cells");
    CHECK(failures_of(verdicts) == "");
  }

  TEST_CASE("probe: two hands: a fault that the other one feels is noticed") {
    FaultSettings settings;
    settings.hands = 2;
    const std::vector<std::byte> scene = fault_scene(2);
    const auto run = [&](const char* name) {
      return run_fault(scene, {FaultState::kArmedContact, &stack_fault_named(name)}, settings);
    };
    const FaultTrace unharmed = run("none");
    const FaultCase lost{FaultState::kArmedContact, &stack_fault_named("lost 50")};
    const FaultTrace trace = run("lost 50");
    CHECK(judge_fault(lost, trace, unharmed, settings).failures.empty());
    FaultTrace felt = trace;
    for (std::size_t k = felt.injected + 5; k < felt.injected + 20; ++k)
      felt.others[k].acting.force_w *= 0.5;
    CHECK(some_failure_says(judge_fault(lost, felt, unharmed, settings), "the other hand: "));
    // An emergency stop is one of both.
    const FaultCase stop{FaultState::kArmedContact, &stack_fault_named("emergency stop by call")};
    FaultTrace kept = run("emergency stop by call");
    CHECK(judge_fault(stop, kept, unharmed, settings).failures.empty());
    kept.others = unharmed.others;
    CHECK(some_failure_says(judge_fault(stop, kept, unharmed, settings), "the other hand: "));
  }

  TEST_CASE("every fault has its rule, in the same order and with a name of its own") {
    REQUIRE(fault_rules().size() == faults().size());
    std::set<std::string> names;
    for (std::size_t k = 0; k < faults().size(); ++k) {
      CHECK(std::string(fault_rules()[k].fault) == faults()[k].name);
      names.insert(faults()[k].name);
    }
    CHECK(names.size() == faults().size());
    CHECK_THROWS_AS(static_cast<void>(stack_fault_named("flood")), tools::InputError);
    FaultSettings direct;
    direct.carrier = StackCarrier::kDirect;
    const FaultCase unplugged{FaultState::kDisarmed, &stack_fault_named("unplug in flight")};
    CHECK_THROWS_AS(static_cast<void>(run_fault(fault_scene(), unplugged, direct)),
                    tools::InputError);
  }

  TEST_CASE("FAULTS.md of hal: its table is the matrix's") {
    const std::string page = text_of(HAPTIC_TEST_DIR "/../hal/FAULTS.md");
    const std::size_t at = page.find("| fault |");
    REQUIRE(at != std::string::npos);
    std::istringstream lines(page.substr(at));
    std::set<std::string> seen;
    for (std::string line; std::getline(lines, line);) {
      const std::vector<std::string> cells = cells_of(line);
      if (cells.size() != 5 || cells[0] == "fault" || cells[0].find("---") == 0) continue;
      std::istringstream names(cells[0]);
      for (std::string name; std::getline(names >> std::ws, name, ',');) {
        CAPTURE(name);
        const auto rule = std::find_if(fault_rules().begin(), fault_rules().end(),
                                       [&](const FaultRule& r) { return name == r.fault; });
        REQUIRE(rule != fault_rules().end());
        CHECK(seen.insert(name).second);
        CHECK(cells[1] == rule->noticed_by);
        CHECK(cells[2] == to_text(rule->output));
        const std::string told =
            rule->device == 0 ? "" : " (" + device_fault_names(rule->device) + ")";
        CHECK(cells[3] == safety_fault_names(rule->safety) + told);
        CHECK(cells[4] == rule->cleared_by);
      }
    }
    CHECK(seen.size() == faults().size() - 1);  // all but none
  }
}

}  // namespace haptic::sim
