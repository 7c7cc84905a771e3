// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Motion-to-force delay as files and as a table.

#include <string>
#include <vector>

#include "host_sim/lab/realtime/motion_delay.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// Delays with one clock of the servo loop.
struct DelayOfMode {
  bool report_clocked = false;
  std::vector<VirtualDelay> exact;
  MeasuredDelays measured;
};
[[nodiscard]] const char* name_of(const DelayOfMode& mode);

/// Least, median, 99 of 100 and largest of the times at which a stage ends [ns].
struct DelayFigures {
  std::int64_t least_ns = 0, median_ns = 0, p99_ns = 0, largest_ns = 0;
};
[[nodiscard]] DelayFigures exact_figures(const DelayOfMode& mode, DelayStage stage);
[[nodiscard]] DelayFigures measured_figures(const DelayOfMode& mode, DelayStage stage);

/// delay.csv (a line per report measured and per phase), delay.json, delay.svg.
[[nodiscard]] std::vector<OutputText> delay_files(const std::string& scene,
                                                  const DelayQuestion& question,
                                                  const std::vector<DelayOfMode>& modes);

}  // namespace haptic::sim
