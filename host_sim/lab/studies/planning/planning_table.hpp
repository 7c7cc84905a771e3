// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Our planner and those of OMPL on the same puzzles and the same verdict: how long, how often, and
/// whether what they find is proved.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host_sim/lab/planning/puzzles.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

struct PlanningOptions {
  double seconds = 120;     ///< of a processor, for one run
  std::uint64_t seeds = 3;  ///< runs of each planner on each puzzle
  bool ours_only = false;
  /// A planner of OMPL that found nothing at one clearance of a puzzle is not run at smaller ones.
  bool until_failed = false;
  bool quick = false;   ///< three puzzles, for tests
  std::string puzzles;  ///< only those whose name begins so; empty: all
  std::string scene;    ///< a compiled scene instead of puzzles, from its start
  std::string goal;     ///< with `scene`: pose of the moving part's file frame
  std::string rows;     ///< file that keeps the rows that are done (KeptRows); empty: none
  bool resume = false;  ///< goes on with that file
  bool progress = false;
};

/// A planner on a puzzle, over all seeds.
struct PlanningRow {
  std::string puzzle, planner;
  double clearance_mm = 0;  ///< 0: none that is stated
  bool solvable = true;
  std::uint64_t runs = 0, found = 0;       ///< 0 runs: it had failed where there is more room
  double median_s = 0, most_s = 0;         ///< of a processor; all runs
  double length_mm = 0;                    ///< of the shortest, before any shortening
  std::uint64_t steps = 0, certified = 0;  ///< of what was found
};

/// The puzzles that are asked for; of a scene of its own the one, with neither text nor clearance.
[[nodiscard]] std::vector<Puzzle> planning_puzzles(const PlanningOptions& options);

/// `done` is called after each row with all that are done.
using PlanningDone = std::function<void(const std::vector<PlanningRow>&)>;
[[nodiscard]] std::vector<PlanningRow> run_planning(const PlanningOptions& options,
                                                    const PlanningDone& done = {});

/// The table as a page and as CSV.
[[nodiscard]] std::vector<OutputText> planning_files(const std::vector<PlanningRow>& rows,
                                                     const PlanningOptions& options);

/// Every step of every plan is certified, ours are found where there are any, and none where there
/// is none.
[[nodiscard]] bool planning_passed(const std::vector<PlanningRow>& rows);

}  // namespace haptic::sim
