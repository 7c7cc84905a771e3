// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The account of `host_sim run`: as JSON, and as text for people.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "hal/device_link.hpp"
#include "host_sim/device/loop_run.hpp"
#include "host_sim/device/rest_judge.hpp"
#include "host_sim/device/simulated_device.hpp"
#include "host_sim/device/stack_run.hpp"
#include "host_sim/session/drive_run.hpp"
#include "host_sim/session/hold_run.hpp"
#include "host_sim/session/other_motion.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::sim {

/// The subject of a run.
struct RunSubject {
  std::string scene, hand;
  LawId law = LawId::kProxy;
  double rate_hz = 0;
  DeviceModel device;
  CouplingParameters rendered{};  ///< the scene's, or what the device holds of it
  std::string lowered;            ///< which of them: a sentence; empty: the scene's
};

/// Beside the hand's motion: its commands, and the driven parts.
struct OtherEvents {
  std::vector<HoldEvent> holds;
  std::vector<DrivenAccount> driven;
};
[[nodiscard]] OtherEvents told_by(const OtherMotion& others);

/// The whole stack: the same, and what happened between rendering and device.
struct StackSubject {
  RunSubject run;
  std::string carrier, faults_file;
  bool report_clocked = false;
  SafetyLimits limits;
};

/// The verdict, and what fails a run besides it.
struct RunEnd {
  tools::SessionVerdict verdict;
  std::string other;

  void add_failure(bool failed, const std::string& what) {
    if (failed) other += (other.empty() ? "" : "; ") + what;
  }
  [[nodiscard]] bool passed() const { return other.empty() && !verdict.failed(); }
  [[nodiscard]] std::string line() const;
};

/// Failures of the loop over any device. `bounded`: every count of work is within its bound.
void add_loop_failures(RunEnd& end, const LoopTotals& t, const RestOscillation& rest, bool bounded);
/// The meaning of the bits of `faults`, with semicolons; empty where there is none.
[[nodiscard]] std::string fault_words(std::uint32_t faults);

/// The loop that the core closes over the device alone.
[[nodiscard]] nlohmann::ordered_json loop_account(const RunSubject& subject, const LoopTotals& t,
                                                  const RestOscillation& rest,
                                                  const OtherEvents& others, const RunEnd& end);
/// The same on standard output, the verdict as its last line.
void print_loop(const RunSubject& subject, const LoopTotals& t, const RestOscillation& rest,
                const OtherEvents& others, const RunEnd& end);

/// One of two hands.
struct HandAccount {
  LoopTotals loop;
  RestOscillation rest;
  RunEnd end;  ///< of this hand alone
};
/// Two hands, with or without a carrier: the account of the first, and that of the second under
/// `hand2`.
[[nodiscard]] nlohmann::ordered_json hands_account(const RunSubject& subject,
                                                   const std::string& carrier,
                                                   const Hands::Each<HandAccount>& hands,
                                                   const OtherEvents& others);
/// The same on standard output, the verdict as its last line.
void print_hands(const RunSubject& subject, const std::string& carrier,
                 const Hands::Each<HandAccount>& hands, const OtherEvents& others);
/// The verdict of both.
[[nodiscard]] RunEnd end_of(const Hands::Each<HandAccount>& hands);

/// The whole stack.
[[nodiscard]] nlohmann::ordered_json stack_account(
    const StackSubject& subject, const StackTotals& t, const RestOscillation& rest,
    const OtherEvents& others, const hal::LinkCounters& link, const RunEnd& end);
/// The same on standard output, the verdict as its last line.
void print_stack(const StackSubject& subject, const StackTotals& t, const RestOscillation& rest,
                 const OtherEvents& others, const hal::LinkCounters& link, const RunEnd& end);

}  // namespace haptic::sim
