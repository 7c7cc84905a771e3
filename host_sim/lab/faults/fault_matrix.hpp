// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Every fault in every state: runs the cells and judges what was handed to the bus and what acted
/// on the hand.

#include <functional>
#include <string>
#include <vector>

#include "host_sim/lab/faults/fault_run.hpp"
#include "host_sim/lab/faults/fault_table.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// Forces as norms. Shares are of what the limits allow, 1 just within.
struct FaultFigures {
  double handed_before_n = 0, handed_after_n = 0;  ///< at the fault, and at the end of the watch
  double acting_before_n = 0, acting_after_n = 0;
  double largest_n = 0;     ///< handed or acting
  double limit_share = 0;   ///< largest force or torque
  double send_share = 0;    ///< largest change from one command to the next
  double acting_share = 0;  ///< largest change at the device except for its own cuts
  double dip_n = 0;         ///< largest loss of force at the device against the run without a fault
  unsigned cuts = 0;        ///< by the device, with force on
  double zero_after_s = -1;  ///< from the fault until nothing acts; -1: it does at the end
  std::uint32_t safety = 0;  ///< SafetyFault, latched at the end of the watch
  std::uint32_t device = 0;  ///< DeviceFault that the servo tick got
  double ramp_in_s = 0;      ///< of the force after the deadman switch is pressed again
  double recovered_n = 0;    ///< at the end of the run
};

struct FaultVerdict {
  FaultCase cell;
  std::size_t hand = 0;  ///< whose device the fault is at
  FaultExpectation expected;
  FaultFigures found;
  std::vector<std::string> failures;  ///< empty: the cell holds
  FaultTrace trace;
};

/// Verdict on one run, by the limits of the reference device, regardless of the stack of `settings`
/// was given. `unharmed`: the run of the same state with no fault.
[[nodiscard]] FaultVerdict judge_fault(const FaultCase& cell, FaultTrace trace,
                                       const FaultTrace& unharmed, const FaultSettings& settings);

struct FaultMatrixOptions {
  FaultSettings run;
  bool quick = false;  ///< the states with force alone
  unsigned threads = 1;
  std::function<bool(const FaultCase&)> wanted;  ///< empty: all
};

/// Cells in the order of faults, then of states; for two hands all with the fault at the first
/// device, then all with it at the second. @throws tools::InputError  a state is not reached.
[[nodiscard]] std::vector<FaultVerdict> run_fault_matrix(const FaultMatrixOptions& options);
[[nodiscard]] bool all_hold(const std::vector<FaultVerdict>& verdicts);

// The fault matrix as files.

/// faults.csv (a line per cell), faults.md (semantics, matrix, failures), faults.svg. Equal
/// verdicts, equal bytes.
[[nodiscard]] std::vector<OutputText> fault_files(const std::vector<FaultVerdict>& verdicts,
                                                  const FaultMatrixOptions& options);

}  // namespace haptic::sim
