// SPDX-License-Identifier: Apache-2.0
#pragma once
/// From fitted planes and merged faces to the corners and planes that have to meet exactly, in
/// local units.

#include <cstdint>
#include <vector>

#include "tools/graph_compiler/polyhedron/flatten_merge.hpp"
#include "tools/graph_compiler/polyhedron/plane_fit.hpp"
#include "tools/graph_compiler/polyhedron/realise.hpp"

namespace haptic::tools {

/// Corners (equal positions are one corner, also across shells) and planes in local units.
struct CornerGraph {
  CornerPlaneGraph graph;
  std::vector<std::uint32_t> vertex_corner;  ///< per vertex of the surface; kNone: gone
  std::vector<std::uint32_t> corner_vertex;  ///< first vertex of each corner
};

/// Without wishes. @param scale  local units per metre.
CornerGraph build_graph(const Surface& s, const PlaneFit& fit, const MergedSurface& merged,
                        double scale);

/// Adds the planes within the tolerance of a corner that they do not bound.
void add_wishes(const Surface& s, double scale, CornerPlaneGraph& graph);

}  // namespace haptic::tools
