// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the hand feels while it leads parts into their holes: the paper's law beside law proxy,
/// without a device and with devices of which the coupling is derived as the compiler does it.

#include <string>
#include <vector>

#include "host_sim/lab/pegs/peg_tasks.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// A device that the scene is compiled for: the limits are those of a kind, not of one product.
struct PegDevice {
  const char* name;
  DeviceParameters device;  ///< not given: no device
};
[[nodiscard]] std::vector<PegDevice> peg_devices();

struct PegRunTick {
  double t_s = 0;
  double force_n = 0, torque_nm = 0;
  double off_m = 0;  ///< part from hand, with what the turn gives at the part's radius
  bool held = false;
};

/// One task under one law with one device.
struct PegResult {
  std::string task, device;
  LawId law = LawId::kPaper;
  double k_t_n_per_m = 0, k_r_nm_per_rad = 0;
  double force_step_n = 0, torque_step_nm = 0;  ///< largest change from tick to tick
  double median_n = 0, largest_n = 0;           ///< of the ticks with a force
  /// Longest run of ticks in which the hand's own pose is free of obstacles, so that the energy
  /// could be zero, and the part is held off it all the same.
  std::uint32_t longest_hold = 0;
  double hold_n = 0;      ///< largest force in such a tick
  bool outlasts = false;  ///< the part is held off when the hand is out again
  double plane_gaps = 0;  ///< per tick, a measure of the work
  std::vector<PegRunTick> ticks;
};

/// @throws tools::InputError when a scene is refused.
/// `length_share`: of the coupling's length in radii of the part; 0: the default.
[[nodiscard]] PegResult run_peg_task(const PegTask& task, const PegDevice& device, LawId law,
                                     double length_share = 0);

/// All over all, by task, then device, then law. `progress`: a line each on stderr.
[[nodiscard]] std::vector<PegResult> run_pegs(bool quick, bool progress, double length_share = 0);

/// What must hold: without a device no step larger than the largest of the paper's law, the median
/// of the tasks' median forces between half and one and a half times the paper's; with any no hold
/// that outlasts the push.
struct PegVerdict {
  double paper_step_n = 0, proxy_step_n = 0, paper_step_nm = 0, proxy_step_nm = 0;
  double paper_median_n = 0, proxy_median_n = 0;
  std::uint32_t outlasting = 0;
  [[nodiscard]] bool steps_hold() const {
    return proxy_step_n <= paper_step_n && proxy_step_nm <= paper_step_nm;
  }
  [[nodiscard]] bool median_holds() const {
    return proxy_median_n >= 0.5 * paper_median_n && proxy_median_n <= 1.5 * paper_median_n;
  }
  [[nodiscard]] bool passed() const { return steps_hold() && median_holds() && outlasting == 0; }
};
[[nodiscard]] PegVerdict verdict_of(const std::vector<PegResult>& results);

/// The table as CSV, JSON and Markdown, and a picture of each task with the largest steps.
[[nodiscard]] std::vector<OutputText> peg_files(const std::vector<PegResult>& results);

}  // namespace haptic::sim
