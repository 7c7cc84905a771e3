// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The campaign on triangle meshes: every scene with 3 passes and with 1 under every motion, every
/// tick judged. Sharded: equal sizes give equal results, regardless of the number of threads.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/lab/surface_fuzz/surface_run.hpp"
#include "host_sim/report/campaign_text.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/report/shard_run.hpp"

namespace haptic::sim {

struct SurfaceFuzzSize {
  std::uint64_t ticks = 200000;  ///< over all scenes, rounded up to whole shards; rests come on top
  std::uint64_t seed = 1;
  std::optional<std::size_t> scenes;  ///< absent: the fixed ones
  std::vector<double> frictions = {0.0, 0.3};
  PartKind as = PartKind::kSolid;     ///< how every part of our own scenes is taken
  std::string scene_file;             ///< not empty: this scene alone, as it says
  std::string motion_file;            ///< not empty: its motion alone
  bool strict = false;                ///< triangles may not even touch
  std::optional<std::uint64_t> only;  ///< the run of this number alone, as a failure names it
  std::optional<SurfaceFault> fault;
};

inline constexpr NamedCount<SurfaceTotals> kSurfaceMustBeZero[] = {
    {"not_free", &SurfaceTotals::deep},         {"passages", &SurfaceTotals::passages},
    {"energy_rises", &SurfaceTotals::rises},    {"not_arrived", &SurfaceTotals::unarrived},
    {"invisible_walls", &SurfaceTotals::walls}, {"not_finite", &SurfaceTotals::infinite},
    {"over_caps", &SurfaceTotals::over_caps},   {"recoveries", &SurfaceTotals::recoveries}};

struct SurfaceFuzzRow {
  std::string scene, motion;
  double friction = 0;
  std::uint32_t passes = 0;           ///< in a tick; of 1 the ticks' ways are judged too
  std::size_t moving = 0, fixed = 0;  ///< triangles
  SurfaceTotals totals;
};

struct SurfaceFuzzResult {
  SurfaceFuzzSize size;
  std::vector<SurfaceFuzzRow> rows;
  /// Where one run was asked for: files by which it can be run elsewhere.
  std::vector<OutputText> files;
  std::vector<MotionSample> motion;
  double seconds = 0;  ///< of the run
  [[nodiscard]] SurfaceTotals totals() const { return sum_of(rows); }
};

/// @throws tools::InputError when a scene cannot be compiled; no run has the number of `only`.
[[nodiscard]] SurfaceFuzzResult run_surface_fuzz(const SurfaceFuzzSize& size,
                                                 const RunOptions& options);

/// The page of surface_fuzz.md.
[[nodiscard]] std::string surface_fuzz_page(const SurfaceFuzzResult& result);
/// With surface_fuzz.csv, .json and .md; of one run also its scene and its motion.
[[nodiscard]] CampaignEnd surface_fuzz_end(const SurfaceFuzzResult& result);

}  // namespace haptic::sim
