// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Every fault of every process in every state of the operator: run_device itself, in real time, on
/// a device in this process. What is judged was seen on the wire.

#include <functional>
#include <string>
#include <vector>

#include "host_sim/lab/processes/command_tap.hpp"
#include "host_sim/lab/processes/process_faults.hpp"
#include "host_sim/lab/processes/served_device.hpp"
#include "host_sim/lab/processes/status_tail.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

struct ProcessCase {
  OperatorState state = OperatorState::kArmedContact;
  const ProcessFault* fault = nullptr;
};

/// Forces as norms. Times from the fault on.
struct ProcessFigures {
  double before_n = 0;         ///< handed to the device at the fault
  double after_n = 0;          ///< at the end of the watch
  double largest_n = 0;        ///< handed from then on
  double largest_step_n = 0;   ///< from one command to the next, but for one that is zero at once
  double step_share = 0;       ///< of what the slew limit allows in two periods
  double rise_n = 0;           ///< of a command over the least one before it
  double above_zero_ms = 0;    ///< how long a force acted
  double largest_late_ms = 0;  ///< of the device's own thread
  double oldest_ms = 0;        ///< of a command that changed the force, when the device got it
  std::size_t too_old = 0;     ///< of them: those older than two periods
  double understated_n = 0;    ///< by how much a status was below what the device had
  std::size_t dated = 0;       ///< commands whose age is known
  std::size_t stated = 0;      ///< statuses that were compared
  std::size_t scribbled = 0;   ///< bytes
  int exit_code = -1;
};

struct ProcessVerdict {
  ProcessCase cell;
  ProcessFigures found;
  std::vector<std::string> failures;  ///< empty: the cell holds
  unsigned tries = 1;                 ///< runs that the machine spoiled are repeated
  std::string spoiled;                ///< how the machine spoiled the last; such a cell fails
  std::vector<std::string> events;    ///< that the program told within the watch
  std::string status;                 ///< its last status line of the watch: arming and force
  std::string said;                   ///< all its lines
  WireRecord wire;
  std::vector<TappedCommand> tapped;  ///< as run_device made them
  std::vector<StatedForce> stated;    ///< by its status lines
  std::int64_t fault_ns = 0;
};

struct ProcessMatrixOptions {
  std::string program;   ///< run_device; empty: next to this one
  bool quick = false;    ///< the state armed in contact alone
  bool bridged = false;  ///< the device is behind a bridge in every case, not in those of it alone
  double stale_ms = 0;   ///< probe: the device's process passes commands on so much later
  std::function<bool(const ProcessCase&)> wanted;
  std::function<void(const ProcessVerdict&)> told;
};

/// In the order of faults, then of states. @throws tools::InputError  run_device is not built, or a
/// state is not reached.
[[nodiscard]] std::vector<ProcessVerdict> run_process_matrix(const ProcessMatrixOptions& options);
[[nodiscard]] bool all_hold(const std::vector<ProcessVerdict>& verdicts);

/// As CSV (a line per cell), as a page and as a picture, all named "processes".
[[nodiscard]] std::vector<OutputText> process_files(const std::vector<ProcessVerdict>& verdicts);

}  // namespace haptic::sim
