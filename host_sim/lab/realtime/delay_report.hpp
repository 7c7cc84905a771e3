// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Motion-to-force delay as files and as a table.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/realtime/threaded_loop.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

// From the sampling of a motion in the device to the moment at which the force that answers it
// acts there, for both clocks of the servo loop: exactly in virtual time, and as this machine does
// it.

/// Where the time goes, one after the other.
enum class DelayStage : std::uint8_t {
  kReport = 0,  ///< sampled -> the report is complete on the USB thread
  kTick,        ///< -> the servo tick that sees it begins
  kCommand,     ///< -> its command is published
  kHanded,      ///< -> the USB thread takes it for the bus
  kActs,        ///< -> the device has it
  kCount
};
inline constexpr std::size_t kDelayStages = static_cast<std::size_t>(DelayStage::kCount);
[[nodiscard]] const char* to_text(DelayStage stage);

/// One motion and its answer; ends of the stages [ns] after the sampling.
using DelayTimes = std::array<std::int64_t, kDelayStages>;

/// Delays of a step of the hand in contact at a phase of the timer, all exact.
struct VirtualDelay {
  double phase = 0;  ///< ticks come this share of a period after the report
  DelayTimes at_ns{};
};

struct DelayQuestion {
  double rate_hz = 1000;  ///< of reports and servo loop
  double seconds = 5;     ///< measured in real time, of each mode
  unsigned phases = 20;   ///< tried in virtual time
};

/// The hand's target steps 2 mm deeper into the wall, and the run is compared with the one in which
/// it does not: the first report, tick, command and acting wrench that differ. Report-clocked
/// there is one phase. @throws tools::InputError  nothing is touched, or the step changes nothing.
[[nodiscard]] std::vector<VirtualDelay> virtual_delays(const std::string& scene,
                                                       const DelayQuestion& question,
                                                       bool report_clocked);

struct MeasuredDelays {
  std::vector<DelayTimes> at_ns;  ///< of every report whose answer acted
  std::uint64_t reports = 0;      ///< whose state was published
  std::uint64_t contact_ticks = 0;
  LoopGrants grants;
};
/// In real time: every report of the run, each answered by the first command that rests on it or a
/// newer one. @throws std::runtime_error  no thread; tools::InputError  the scene.
[[nodiscard]] MeasuredDelays measured_delays(const std::string& scene,
                                             const DelayQuestion& question, bool report_clocked);

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
