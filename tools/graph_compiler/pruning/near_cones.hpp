// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Normals with which a feature can be near, not only touch. The loop weighs basic contacts that
/// are not applicable by less than epsilon (rt_core/contact/near_set.hpp): no neighbour of a vertex
/// rises higher than that over the plane of contact, no apex of a face next to an edge. Their
/// normals lie in the feature's own cone or a little way beyond it, farther where edges are short.

#include <vector>

#include "tools/graph_compiler/pruning/feature_cones.hpp"

namespace haptic::tools {

/// Normals of an edge; `all_round`: every direction square to it.
struct NearArc {
  SphericalArc arc;
  bool all_round = false;
};

/// Of one piece, numbered as in its PieceShape.
struct NearCones {
  /// Largest angle [rad] of such a normal to the vertex's cone; pi where all may be.
  std::vector<double> vertex_reach_rad;
  std::vector<NearArc> edges;  ///< the edges' arcs, longer by what is near
  /// What the body leaves open, as in PieceShape: arcs longer by what is near, and the cone of a
  /// hidden vertex at which an open edge ends.
  std::vector<std::vector<NearArc>> open_edges;
  std::vector<std::vector<SphericalPolygon>> open_vertices;
};

/// `epsilon_m` as the loop has it. Cost: cube of the edges at each vertex.
NearCones near_cones(const PieceShape& shape, double epsilon_m);

}  // namespace haptic::tools
