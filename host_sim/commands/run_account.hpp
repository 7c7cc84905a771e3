// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The account of `host_sim run`: as JSON, and as text for people.

#include <nlohmann/json.hpp>
#include <string>

#include "host_sim/device/stack_run.hpp"

namespace haptic::sim {

/// What was run.
struct RunSubject {
  std::string scene, hand;
  LawId law = LawId::kProxy;
  double rate_hz = 0;
  DeviceModel device;
};

/// The loop that the core closes over the device alone.
[[nodiscard]] nlohmann::ordered_json loop_account(const RunSubject& subject, const LoopTotals& t,
                                                  bool passed);
void print_loop(const RunSubject& subject, const LoopTotals& t, bool passed);

/// The whole stack: the same, and what happened between rendering and device.
struct StackSubject {
  RunSubject run;
  std::string carrier, faults_file;
  bool report_clocked = false;
  SafetyLimits limits;
};
[[nodiscard]] nlohmann::ordered_json stack_account(const StackSubject& subject,
                                                   const StackTotals& t,
                                                   const hal::LinkCounters& link, bool passed);
void print_stack(const StackSubject& subject, const StackTotals& t, const hal::LinkCounters& link,
                 bool passed);

}  // namespace haptic::sim
