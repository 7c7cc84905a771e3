// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Tables and the picture of a cost report.

#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/cost/cost_comparison.hpp"
#include "host_sim/lab/cost/cost_work.hpp"
#include "host_sim/session/counters_check.hpp"

namespace haptic::sim {

/// Figures of a scene, over all ticks from the first on.
struct CostFigures {
  std::size_t contact_ticks = 0;  ///< the part as it is felt touches something
  double mean_instructions = 0;   ///< this and the next three: 0 where they were not counted
  std::uint64_t p50_instructions = 0, p99_instructions = 0, most_instructions = 0;
  /// The first tick with most instructions; where they were not counted, with most work.
  std::size_t largest_tick = 0;
  double median_us = 0, p99_us = 0, largest_us = 0;  ///< of the times
  /// Ticks timed with cold caches too: their number, times as warm as can be from the same state,
  /// and times after a flush; 0 where there are none.
  std::size_t cold_ticks = 0;
  double same_warm_median_us = 0, cold_median_us = 0, cold_largest_us = 0;
  std::size_t cold_largest_tick = 0;
  std::uint64_t most_work = 0, work_bound = 0;  ///< proxy_units, and what a tick may do
  double least_gap_m = 0;
  std::vector<CounterBound> bounds;  ///< largest count of any tick against the header
  std::size_t not_finite = 0;        ///< ticks with a force, torque or pose that is no number
  bool same_result = true;           ///< a tick repeated from the same state ends in the same one

  /// Every count within its bound, every result a number, and a tick again gives the same.
  [[nodiscard]] bool passed() const { return all_held(bounds) && not_finite == 0 && same_result; }
};
/// @param run  with at least one tick.
[[nodiscard]] CostFigures figures_of(const CostRun& run);

/// NAME.csv: a line per tick, its time, instructions, contact, flags, a column per counter,
/// force, torque and pose of the proxy. 17 digits; no times, so that the same build writes the same
/// bytes.
[[nodiscard]] std::string cost_ticks_csv(const CostRun& run);

/// cost.csv: a row per scene.
[[nodiscard]] std::string cost_csv(std::span<const CostRun> runs);
/// cost.json: the same, with all bounds and the functions with the largest share, and the
/// comparison where there is one.
[[nodiscard]] std::string cost_json(std::span<const CostRun> runs,
                                    std::span<const CostDifference> differences);
/// cost.svg: a curve per scene over the instructions of a tick. Upper panel: share of the ticks up
/// to that value; lower panel: share above it, logarithmic. Of the times where a scene has no
/// instructions.
[[nodiscard]] std::string cost_picture(std::span<const CostRun> runs);
/// For people: a line per scene, and the largest tick of each.
[[nodiscard]] std::string cost_table(std::span<const CostRun> runs);

}  // namespace haptic::sim
