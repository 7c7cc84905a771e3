// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a guide is worth: hands put a square peg into its hole with contact alone, with a guide,
/// and with guides that are wrong, in the closed loop of `host_sim run`.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/studies/planning/insertion_hand.hpp"
#include "host_sim/report/part_report.hpp"
#include "tools/common/scene_bytes.hpp"

namespace haptic::sim {

struct GuideStudyOptions {
  std::uint64_t runs = 1000;  ///< of a cell
  std::uint64_t plans = 4;    ///< seeds of the planner; runs take them in turn
  std::uint64_t seed = 1;     ///< of the hands: run k of every cell has the same hand
  double clearance_mm = 0.3;  ///< of the peg
  std::uint32_t threads = 1;
  bool progress = false;
};

/// What leads the hand in a column of the study: a scene per plan.
struct StudyGuide {
  std::string name;
  bool wrong = false;  ///< it leads elsewhere
  std::vector<tools::SceneBytes> scenes;
};

/// The task and all guides. Without a guide; with the plan; with one down a harmonic function, by
/// translations alone from where the hand begins, upright; with one that begins 16 mm aside and
/// upright; with that of another scene, whose hole lies 3 mm aside.
struct GuideStudyBench {
  InsertionTask task;
  DeviceModel device;
  std::vector<StudyGuide> guides;
};
[[nodiscard]] GuideStudyBench guide_study_bench(const GuideStudyOptions& options);

struct InsertionRun {
  bool inserted = false, sound = true;  ///< sound: finite, and no faster than a hand
  double time_s = 0;                    ///< until it was in; else the limit
  double peak_n = 0;                    ///< largest contact force
  double hand_j = 0;                    ///< work of the hand
  double guide_j = 0;                   ///< the most that the guide had done at any time
  double stated_j = 0;                  ///< the most that its scene states; 0: no guide
};

/// One hand, one scene. Cost: at most the ticks of the limit.
[[nodiscard]] InsertionRun run_insertion(const GuideStudyBench& bench,
                                         const tools::SceneBytes& scene, const HandModel& hand,
                                         std::uint64_t seed);

struct StudyCell {
  std::string hand, guide;
  bool wrong = false;
  std::vector<InsertionRun> runs;
  [[nodiscard]] double inserted_share() const;
  /// A figure of all runs, ascending.
  [[nodiscard]] std::vector<double> sorted(double InsertionRun::*figure) const;
};

/// All hands but nobody's, with all guides. The number of threads changes nothing.
[[nodiscard]] std::vector<StudyCell> run_guide_study(const GuideStudyBench& bench,
                                                     const GuideStudyOptions& options);

/// What must hold: every run is sound; no guide does more than its scene states; with the right
/// guide no hand puts in fewer than with contact alone, but for one of a hundred runs, takes longer
/// (median and p90), or presses harder (median and p95 of the largest contact forces).
struct StudyVerdict {
  bool sound = true, within_energy = true, helps = true, as_fast = true, as_gentle = true;
  [[nodiscard]] bool passed() const {
    return sound && within_energy && helps && as_fast && as_gentle;
  }
};
[[nodiscard]] StudyVerdict verdict_of(const std::vector<StudyCell>& cells);

/// guide_study.{csv,json,md,svg} and guide_study_runs.csv, a line per run.
[[nodiscard]] std::vector<OutputText> guide_study_files(const GuideStudyBench& bench,
                                                        const std::vector<StudyCell>& cells,
                                                        const GuideStudyOptions& options);

}  // namespace haptic::sim
