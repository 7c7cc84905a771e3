// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The paper's steps as printed against the exhaustive search, in both readings of delta, and the
/// core next to them on the same paths (rt_core/METHOD.md section 7.1).

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/oracle/scene_oracle.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/shapes/coherent_path.hpp"

namespace haptic::sim {

/// What a tracker got wrong on the paths of one pair.
struct TrackerScore {
  CheckTotals totals;  ///< summed over the paths; the longest run is the longest of any path
  std::uint64_t empty_sets = 0;

  void add(const CheckTotals& path);
};

struct LiteralRow {
  std::string pair;
  PathSpeed speed;
  std::uint64_t ticks = 0, separated = 0;
  TrackerScore translation, rotation, core;  ///< delta = |dx|; |dx| + L dtheta; HapticCore
  std::uint64_t relocalised = 0;             ///< ticks of the core with a second search
};

/// One line of the table: `paths` paths of `ticks` ticks each.
[[nodiscard]] LiteralRow literal_row(const Solid& a, const Solid& b, const PathSpeed& speed,
                                     std::uint32_t paths, std::uint32_t ticks, std::uint64_t seed);

[[nodiscard]] PartReport literal_part(const ReproductionSize& size);

}  // namespace haptic::sim
