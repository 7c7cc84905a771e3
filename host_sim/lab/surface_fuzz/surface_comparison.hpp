// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The same meshes compiled twice, as solids and as surfaces, under the same motions: how far the
/// forces differ.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/surface_fuzz/surface_run.hpp"
#include "host_sim/report/campaign_text.hpp"
#include "host_sim/report/shard_run.hpp"

namespace haptic::sim {

/// The forces may differ by this much [N]: both settle within the tolerance, not to the same bit.
/// In single precision one of the two may settle or slip a tick later.
inline constexpr double kMostApart_n = sizeof(Real) == sizeof(float) ? 2 : 3e-4;

struct SurfaceComparisonRow {
  std::string scene;
  double speed_m_per_s = 0;
  bool turning = false;               ///< yaw and roll on the way
  std::uint64_t ticks = 0, held = 0;  ///< held: with a force above 1 mN in either
  double largest_force_n = 0;
  double median_n = 0, p99_n = 0, largest_n = 0;  ///< of the difference, over the held ticks
  /// Ticks in which a flat top alone holds the part in both, so that the force is known; how far
  /// the solids' is from it at most, and by how much the other's is farther in the same tick.
  std::uint64_t on_top = 0;
  double solid_off_n = 0, farther_off_n = 0;

  [[nodiscard]] bool failed() const { return held == 0 || !(largest_n <= kMostApart_n); }
};

struct SurfaceComparison {
  PartKind as = PartKind::kSurface;
  std::vector<SurfaceComparisonRow> rows;
  [[nodiscard]] bool failed() const;
};

/// Four contacts (a flat top with T-junctions, the edge of a block, a cylinder of 32 sides, floor
/// and wall), each at 0.1 m/s, at 0.1 m/s with yaw and roll, and at 0.3 m/s with both: solids
/// against the same parts taken `as`, held apart by the skin of facets as those are. `faulty`: the
/// second device is 1 mm off, so that the check must fail.
/// @throws tools::InputError when a scene cannot be compiled.
[[nodiscard]] SurfaceComparison compare_surfaces(PartKind as, bool faulty,
                                                 const RunOptions& options);

/// The page of surface_compare.md.
[[nodiscard]] std::string surface_comparison_page(const SurfaceComparison& comparison);
/// With surface_compare.csv, .json and .md.
[[nodiscard]] CampaignEnd surface_comparison_end(const SurfaceComparison& comparison);

}  // namespace haptic::sim
