// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Corners where more than three planes no longer meet in a point, taken apart into corners of
/// three planes each with short edges between them.

#include "tools/graph_compiler/polyhedron/flatten_merge.hpp"

namespace haptic::tools {

/// Every corner of `merged` with four to eight faces around it, of which some plane misses the
/// vertex by more than `tolerance_m`, becomes corners of three planes: the polygon of its faces is
/// cut into triangles, a triangle is a corner, a diagonal is a new edge. Among the ways to do so
/// that keep the borders of the faces free of crossings the one with the least movement is taken;
/// where there is none within `max_move_m`, the corner stays. New vertices are appended to
/// `surface`, new edges to `merged`. Returns, for each vertex appended, the vertex that it was part
/// of. Cost: at most 132 ways per corner.
std::vector<std::uint32_t> split_corners(Surface& surface, const PlaneFit& fit,
                                         MergedSurface& merged, double tolerance_m,
                                         double max_move_m);

}  // namespace haptic::tools
