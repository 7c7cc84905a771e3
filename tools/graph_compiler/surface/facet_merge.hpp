// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Triangles in one plane merged into convex polygons.

#include <cstdint>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

struct MergeLimits {
  double plane_m = 0.0;           ///< distance within which corners lie in one plane or line
  std::size_t most_corners = 24;  ///< of a polygon
};

/// Merges polygons over sides that two of them share in opposite sense, the longest first, where
/// the union is convex, flat to within the limit and has no more corners than allowed; then takes
/// out corners that are straight in every polygon that has them. Nothing moves: the union of all
/// polygons stays the same set, and no corner comes to lie inside a side. Merged polygons are left
/// without corners; `source` names the first face of the file in each. Cost: O(n log n) a round,
/// at most kMergeRounds.
void merge_facets(const std::vector<Point3>& points, std::vector<std::vector<std::uint32_t>>& loops,
                  std::vector<std::uint32_t>& source, const MergeLimits& limits);

inline constexpr int kMergeRounds = 8;

}  // namespace haptic::tools
