// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/processes/process_faults.hpp"

#include <csignal>
#include <string>

#include "host_sim/report/part_report.hpp"

namespace haptic::sim {
namespace {

using V = ProcessVictim;
using C = ProcessCause;
using O = ProcessOutput;

constexpr const char* kSpareBegins = "begins; no force until";
constexpr const char* kNoCrash = "servo process 0";
constexpr const char* kKeeper = "zero-keeper";

constexpr ProcessFault kFaults[] = {
    {"none", V::kServo, C::kNothing, 0, O::kGoesOn, -1, "", kNoCrash, "-"},
    {"SIGKILL", V::kServo, C::kSignal, SIGKILL, O::kRampsToZero, -1, kSpareBegins},
    {"SIGSEGV", V::kServo, C::kSignal, SIGSEGV, O::kRampsToZero, -1, kSpareBegins},
    {"SIGABRT", V::kServo, C::kSignal, SIGABRT, O::kRampsToZero, -1, kSpareBegins},
    {"SIGSTOP", V::kServo, C::kSignal, SIGSTOP, O::kRampsToZero, -1, "hung, and killed"},
    {"SIGTERM", V::kServo, C::kSignal, SIGTERM, O::kGoesOn, -1, "", kNoCrash},
    {"scribbles 0x41", V::kServo, C::kScribble, 0x41, O::kBounded, -1, "", "guardian"},
    {"scribbles 0xff", V::kServo, C::kScribble, 0xff, O::kBounded, -1, "", "guardian"},
    {"scribbles at random", V::kServo, C::kScribble, -1, O::kBounded, -1, "", "guardian"},
    {"SIGKILL", V::kSpare, C::kSignal, SIGKILL, O::kGoesOn, -1, "", kNoCrash},
    {"SIGSTOP", V::kSpare, C::kSignal, SIGSTOP, O::kGoesOn, -1, "", kNoCrash},
    {"scribbles 0x41", V::kSpare, C::kScribble, 0x41, O::kGoesOn, -1, "", kNoCrash},
    {"scribbles 0xff", V::kSpare, C::kScribble, 0xff, O::kGoesOn, -1, "", kNoCrash},
    {"scribbles at random", V::kSpare, C::kScribble, -1, O::kGoesOn, -1, "", kNoCrash},
    {"SIGKILL", V::kServoAndSpare, C::kSignal, SIGKILL, O::kRampsToZero, 1, "there is no spare"},
    {"SIGSTOP", V::kServoAndSpare, C::kSignal, SIGSTOP, O::kRampsToZero, 1, "there is no spare"},
    {"SIGHUP", V::kGuardian, C::kSignal, SIGHUP, O::kRampsToZero, 0, "SIGHUP", kNoCrash},
    {"SIGINT", V::kGuardian, C::kSignal, SIGINT, O::kRampsToZero, 0, "SIGINT", kNoCrash},
    {"SIGQUIT", V::kGuardian, C::kSignal, SIGQUIT, O::kRampsToZero, 0, "SIGQUIT", kNoCrash},
    {"SIGTERM", V::kGuardian, C::kSignal, SIGTERM, O::kRampsToZero, 0, "SIGTERM", kNoCrash},
    {"SIGUSR1", V::kGuardian, C::kSignal, SIGUSR1, O::kRampsToZero, 0, "SIGUSR1", kNoCrash},
    {"SIGUSR2", V::kGuardian, C::kSignal, SIGUSR2, O::kRampsToZero, 0, "SIGUSR2", kNoCrash},
    {"SIGALRM", V::kGuardian, C::kSignal, SIGALRM, O::kRampsToZero, 0, "SIGALRM", kNoCrash},
    {"SIGTSTP", V::kGuardian, C::kSignal, SIGTSTP, O::kRampsToZero, 0, "SIGTSTP", kNoCrash},
    {"SIGPIPE", V::kGuardian, C::kSignal, SIGPIPE, O::kGoesOn, -1, "", kNoCrash},
    {"SIGSEGV", V::kGuardian, C::kSignal, SIGSEGV, O::kZeroAtOnce, 128 + SIGSEGV},
    {"SIGABRT", V::kGuardian, C::kSignal, SIGABRT, O::kZeroAtOnce, 128 + SIGABRT},
    {"SIGKILL", V::kGuardian, C::kSignal, SIGKILL, O::kZeroAtOnce, 128 + SIGKILL},
    {"SIGSTOP", V::kGuardian, C::kSignal, SIGSTOP, O::kZeroAtOnce, -1},
    {"SIGKILL", V::kZeroKeeper, C::kSignal, SIGKILL, O::kGoesOn, -1, kKeeper, kNoCrash},
    {"SIGSTOP", V::kZeroKeeper, C::kSignal, SIGSTOP, O::kGoesOn, -1, "", kNoCrash},
    {"SIGTERM", V::kGroup, C::kSignal, SIGTERM, O::kRampsToZero, 0, "SIGTERM", kNoCrash},
    {"SIGINT", V::kGroup, C::kSignal, SIGINT, O::kRampsToZero, 0, "SIGINT", kNoCrash},
    {"SIGHUP", V::kGroup, C::kSignal, SIGHUP, O::kRampsToZero, 0, "SIGHUP", kNoCrash},
    {"SIGTSTP", V::kGroup, C::kSignal, SIGTSTP, O::kRampsToZero, 0, "SIGTSTP", kNoCrash},
    {"SIGKILL", V::kGroup, C::kSignal, SIGKILL, O::kZeroAtOnce, 128 + SIGKILL},
    {"closed", V::kTerminal, C::kClose, 0, O::kRampsToZero, 0, "SIGHUP", kNoCrash},
    {"gone", V::kLogReader, C::kClose, 0, O::kGoesOn, -1, "", kNoCrash},
    {"stops reading, then SIGTERM", V::kLogReader, C::kStopReading, SIGTERM, O::kRampsToZero, 4,
     "SIGTERM", kNoCrash},
    {"starts", V::kSecondProgram, C::kStart, 0, O::kGoesOn, -1, "", kNoCrash},
    {"takes its place", V::kSecondDevice, C::kReplace, 0, O::kZeroAtOnce, -1, "the device is away",
     kNoCrash},
    {"deaf for 5 ms", V::kDevice, C::kDeaf, 5, O::kGoesOn, -1, "", kNoCrash},
    {"deaf for 20 ms", V::kDevice, C::kDeaf, 20, O::kZeroAtOnce, -1, "", kNoCrash},
    {"deaf for 300 ms", V::kDevice, C::kDeaf, 300, O::kZeroAtOnce, -1, "", kNoCrash},
    {"deaf for 1500 ms", V::kDevice, C::kDeaf, 1500, O::kZeroAtOnce, -1, "", kNoCrash},
    {"deaf for 450 ms while the guardian gets SIGKILL", V::kDevice, C::kDeafThenKill, 450,
     O::kZeroAtOnce, 128 + SIGKILL},
    {"SIGKILL", V::kBridge, C::kSignal, SIGKILL, O::kZeroAtOnce, -1, "the device is away",
     kNoCrash},
    {"SIGSEGV", V::kBridge, C::kSignal, SIGSEGV, O::kZeroAtOnce, -1, "the device is away",
     kNoCrash},
    {"SIGTERM", V::kBridge, C::kSignal, SIGTERM, O::kZeroAtOnce, -1, "the device is away",
     kNoCrash},
    {"SIGSTOP", V::kBridge, C::kSignal, SIGSTOP, O::kZeroAtOnce, -1, "", kNoCrash},
    {"stopped for 5 ms", V::kBridge, C::kStopThenGo, 5, O::kBounded, -1, "", kNoCrash},
    {"stopped for 20 ms", V::kBridge, C::kStopThenGo, 20, O::kZeroAtOnce, -1, "", kNoCrash},
    {"stopped for 300 ms", V::kBridge, C::kStopThenGo, 300, O::kZeroAtOnce, -1, "", kNoCrash},
    {"stopped for 1000 ms", V::kBridge, C::kStopThenGo, 1000, O::kZeroAtOnce, -1, "", kNoCrash},
    {"stopped for 1500 ms", V::kBridge, C::kStopThenGo, 1500, O::kZeroAtOnce, -1, "", kNoCrash},
    {"stopped for 450 ms while the guardian gets SIGKILL", V::kBridge, C::kDeafThenKill, 450,
     O::kZeroAtOnce, 128 + SIGKILL},
    {"deaf for 5 ms", V::kBridge, C::kDeaf, 5, O::kBounded, -1, "", kNoCrash},
    {"deaf for 20 ms", V::kBridge, C::kDeaf, 20, O::kZeroAtOnce, -1, "", kNoCrash},
    {"deaf for 300 ms", V::kBridge, C::kDeaf, 300, O::kZeroAtOnce, -1, "", kNoCrash},
    {"deaf for 1500 ms", V::kBridge, C::kDeaf, 1500, O::kZeroAtOnce, -1, "", kNoCrash},
    {"scribbles 0x41", V::kBridge, C::kScribble, 0x41, O::kBounded, -1, "", kNoCrash},
    {"scribbles 0xff", V::kBridge, C::kScribble, 0xff, O::kBounded, -1, "", kNoCrash},
    {"scribbles at random", V::kBridge, C::kScribble, -1, O::kBounded, -1, "", kNoCrash},
};

}  // namespace

const char* to_text(OperatorState state) {
  constexpr const char* kTexts[] = {"disarmed",       "arming",    "armed, free",
                                    "armed, contact", "disarming", "faulted"};
  return kTexts[static_cast<std::size_t>(state)];
}

const char* to_text(ProcessVictim victim) {
  constexpr const char* kTexts[] = {
      "servo",    "spare",      "servo and spare", "guardian",      "zero-keeper",    "whole group",
      "terminal", "log reader", "second program",  "second device", "device process", "bridge"};
  return kTexts[static_cast<std::size_t>(victim)];
}

const char* to_text(ProcessOutput output) {
  constexpr const char* kTexts[] = {"goes on", "bounded", "ramps to zero", "zero at once"};
  return kTexts[static_cast<std::size_t>(output)];
}

std::span<const ProcessFault> process_faults() { return kFaults; }

std::string process_semantics() {
  struct Row {
    std::string process, faults;
    const ProcessFault* fault;
  };
  std::vector<Row> rows;
  for (const ProcessFault& fault : process_faults()) {
    if (fault.cause == ProcessCause::kNothing) continue;
    Row* same = nullptr;
    for (Row& row : rows) {
      const ProcessFault& other = *row.fault;
      if (other.victim == fault.victim && other.output == fault.output &&
          (other.exit_code == fault.exit_code || (other.exit_code > 128 && fault.exit_code > 128)))
        same = &row;
    }
    if (same != nullptr) {
      same->faults += std::string(", ") + fault.name;
    } else {
      rows.push_back({to_text(fault.victim), fault.name, &fault});
    }
  }
  std::string table = table_head({"process", "fault", "output", "run_device"});
  for (const Row& row : rows) {
    const int code = row.fault->exit_code;
    const std::string end = code < 0     ? "goes on"
                            : code > 128 ? "has ended"
                                         : "ends, exit code " + std::to_string(code);
    table += table_row({row.process, row.faults, to_text(row.fault->output), end});
  }
  return table;
}

}  // namespace haptic::sim
