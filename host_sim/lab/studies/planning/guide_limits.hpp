// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a guide must not do: make a loop unstable that is stable without it, or do more work than
/// its scene states.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/planning/hostile_hand.hpp"
#include "host_sim/lab/stability/stability_trial.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// Self-tests: what must be found then.
enum class GuideFault : std::uint8_t {
  kNone,
  kEnergy,  ///< the stated energy is taken for a hundredth: exceeded
  kStiff    ///< the guide pulls and holds forty times as strongly: cells are worse
};

struct GuideLimitsOptions {
  bool quick = false;  ///< fewer cells and shorter rests
  std::uint64_t ticks = 1'000'000;
  std::uint64_t seed = 11;
  GuideFault fault = GuideFault::kNone;
  std::uint32_t threads = 1;
  bool progress = false;
  std::string rows;     ///< file that keeps what is done (KeptRows); empty: none
  bool resume = false;  ///< goes on with that file
};

/// Largest stiffness of the coupling up to which all of peg_stiffnesses() come to rest, with the
/// guide and without [N/m].
struct GuideCell {
  TrialSetting setting;
  bool at_goal = false;  ///< the peg rests at the plan's goal, else half of the hole before it
  double without_n_per_m = 0, with_n_per_m = 0;
  double seconds = 0;  ///< of a processor; half of what the two places took
  [[nodiscard]] bool worse() const { return with_n_per_m < without_n_per_m; }
};

struct GuideLimits {
  std::vector<GuideCell> cells;
  HostileRun hostile;
  /// No cell is worse, some cell rests, and no more energy than stated over a run that was led.
  [[nodiscard]] bool passed() const;
};

/// A square peg 20 mm deep in a hole with 0.1 mm of clearance, law proxy; plans to where it rests,
/// and to the end of the hole.
[[nodiscard]] GuideLimits run_guide_limits(const GuideLimitsOptions& options);

/// guide_limits.{csv,md}.
[[nodiscard]] std::vector<OutputText> guide_limits_files(const GuideLimits& limits,
                                                         const GuideLimitsOptions& options);

}  // namespace haptic::sim
