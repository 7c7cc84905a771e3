// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Arcs of the edges of a piece on the Gauss sphere, each extended by what epsilon allows
/// (EdgeArc): which normals an edge can carry, for the search of near edge pairs.

#include <array>
#include <vector>

#include "rt_core/scene/scene_format.hpp"
#include "tools/graph_compiler/graph/body_geometry.hpp"
#include "tools/graph_compiler/graph/piece_topology.hpp"
#include "tools/graph_compiler/graph/wide3.hpp"

namespace haptic::tools {

/// The rounded geometry of one piece, widened again: what the core reads, so that bounds hold for
/// it and not for the mesh.
struct WidePiece {
  WidePiece(const PieceTopology& piece_topology, const BodyGeometry& geometry, std::size_t piece);

  const PieceTopology* topology;
  std::vector<Wide3> vertices;
  std::vector<Wide3> normals;  ///< outward, by face
  std::vector<Wide3> along;    ///< unit directions, by edge
};

/// An arc before its rounding to Real. It already holds the margin of that rounding.
struct WideArc {
  Wide3 mid, side;
  Wide cosine, sine;  ///< of the half angle
  Wide width_m[2];    ///< distance of apex[k] from the edge's line
  bool full;          ///< the whole circle: a face is no wider than epsilon

  /// Unit normal at the end on the side of face[k].
  [[nodiscard]] Wide3 end(int k) const { return cosine * mid + (k == 0 ? -sine : sine) * side; }
};

/// Arc of edge `e`: between the normals of its faces, longer on side k by the angle at which
/// apex[k] rises by `epsilon_m` over a plane through the edge. Where an apex cannot rise so far,
/// turning on lowers it again, and the arc is the whole circle. The half angle is rounded outwards
/// by more than the rounding to Real.
WideArc wide_arc(const WidePiece& piece, std::uint32_t e, double epsilon_m);

/// The arcs of all edges, rounded. Cost: O(E).
std::vector<EdgeArc> edge_arcs(const WidePiece& piece, const std::vector<WideArc>& arcs,
                               double epsilon_m);

/// The middles of all arcs, rounded: of a facet's edges the normals of its sides. Cost: O(E).
std::vector<std::array<Real, 3>> arc_middles(const std::vector<WideArc>& arcs);

}  // namespace haptic::tools
