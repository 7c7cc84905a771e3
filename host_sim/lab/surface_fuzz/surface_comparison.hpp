// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The same meshes compiled twice, as solids and as surfaces, under the same motions: how far the
/// forces differ.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/surface_fuzz/surface_run.hpp"
#include "host_sim/report/shard_run.hpp"

namespace haptic::sim {

/// A larger difference of the forces is that of two parts of which one has slipped off an edge and
/// the other not yet [N]; ticks in a row that it may last, and its share of all with a force.
inline constexpr double kSlip_n = 1e-3;
inline constexpr std::uint64_t kLongestSpell = 3;
inline constexpr double kLargestShareApart = 0.01;

struct SurfaceComparisonRow {
  std::string scene;
  double speed_m_per_s = 0;
  bool turning = false;               ///< yaw and roll on the way
  std::uint64_t ticks = 0, held = 0;  ///< held: with a force above 1 mN in either
  double largest_force_n = 0;
  double median_n = 0, p99_n = 0, largest_n = 0;  ///< of the difference, over the held ticks
  std::uint64_t apart = 0, longest = 0;  ///< ticks above kSlip_n, and most of them in a row
  double beside_n = 0;                   ///< largest difference in the other ticks

  [[nodiscard]] bool failed() const {
    return held == 0 || longest > kLongestSpell ||
           static_cast<double>(apart) > kLargestShareApart * static_cast<double>(held);
  }
};

struct SurfaceComparison {
  PartKind as = PartKind::kSurface;
  std::vector<SurfaceComparisonRow> rows;
  [[nodiscard]] bool failed() const;
};

/// Four contacts (a flat top with T-junctions, the edge of a block, a cylinder of 32 sides, floor
/// and wall), each at 0.1 m/s, at 0.1 m/s with yaw and roll, and at 0.3 m/s with both: solids
/// against the same parts taken `as`. `faulty`: the second device is 1 mm off, so that the check
/// must fail.
/// @throws tools::InputError when a scene cannot be compiled.
[[nodiscard]] SurfaceComparison compare_surfaces(PartKind as, bool faulty,
                                                 const RunOptions& options);

/// surface_compare.csv, .json and .md in `folder`, which must exist.
/// @throws tools::InputError naming the file.
void write_surface_comparison(const std::string& folder, const SurfaceComparison& comparison);
/// The page of surface_compare.md.
[[nodiscard]] std::string surface_comparison_page(const SurfaceComparison& comparison);

}  // namespace haptic::sim
