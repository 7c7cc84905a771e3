// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Two cost reports of the same scenes and motions: how far the results of two builds are apart,
/// and the instructions of both.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/cost/cost_work.hpp"

namespace haptic::sim {

/// A tick of an earlier report, as far as it is compared.
struct EarlierTick {
  double t_s = 0;
  std::uint64_t instructions = 0;  ///< 0: not counted
  double force_n[3] = {}, torque_nm[3] = {}, proxy_m[3] = {}, proxy_wxyz[4] = {};
};

/// A scene of an earlier report.
struct EarlierRun {
  std::vector<EarlierTick> ticks;
  std::string motion;  ///< bytes of its motion file; empty: it has none
};

/// Reads FOLDER/NAME.csv by the names of its columns, so that counters may come and go, and
/// FOLDER/NAME_motion.csv. @return nothing where there is no such table.
/// @throws tools::InputError "file:line: ..." a column is missing, a line is short, no number.
[[nodiscard]] std::optional<EarlierRun> read_earlier_run(const std::string& folder,
                                                         const std::string& name);

/// Sizes of the differences over the ticks that both runs have.
struct DifferenceFigures {
  double largest = 0, p99 = 0;
};

/// Instructions per tick of a run.
struct InstructionFigures {
  double mean = 0;
  std::uint64_t p99 = 0, largest = 0;
};

struct CostDifference {
  std::string scene;
  /// What the earlier report lacks: the scene, ticks, or the same motion. Empty: nothing.
  std::string missing;
  std::size_t ticks = 0;      ///< compared
  std::size_t differing = 0;  ///< of which in any digit of force, torque or proxy
  std::size_t first_differing = 0;
  std::size_t largest_at = 0;  ///< tick of the largest difference of force
  DifferenceFigures force_n, torque_nm, proxy_m, proxy_rad;
  /// Of all ticks; absent where one of the two has not counted them.
  std::optional<InstructionFigures> before, after;
};

/// Compares a run with the earlier one of that name; `motion`: bytes of its motion file.
[[nodiscard]] CostDifference difference_of(const CostRun& run, const std::string& motion,
                                           const std::optional<EarlierRun>& earlier);

/// False: something is missing. Differences alone fail nothing: they are what is asked for.
[[nodiscard]] bool all_compared(std::span<const CostDifference> differences);

/// comparison.csv: a row per scene.
[[nodiscard]] std::string comparison_csv(std::span<const CostDifference> differences);
/// For people.
[[nodiscard]] std::string comparison_table(std::span<const CostDifference> differences);

}  // namespace haptic::sim
