// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The compiler's knowledge of the basic contacts that a scene needs (METHOD section 11): plain
/// data from the pruning to the writer. Lists are by piece in the order of the scene (pieces of the
/// moving body, then of every static body) and by pair in the writer's order; an empty list says
/// that nothing is known, hence nothing may be left out.

#include <array>
#include <cstdint>
#include <numbers>
#include <vector>

namespace haptic::tools {

/// Orientations that the moving part takes: those whose angle to `about_xyzw` is at most
/// `max_angle_rad`. `about_xyzw` is q_wa, unit: the moving mesh's axes to W.
struct OrientationEnvelope {
  std::array<double, 4> about_xyzw{0, 0, 0, 1};
  double max_angle_rad = std::numbers::pi;
  /// True when every orientation is allowed.
  [[nodiscard]] bool is_free() const { return !(max_angle_rad < std::numbers::pi); }
};

/// Where the grip point of the moving part goes: an axis-aligned box in W [m], faces included. It
/// holds for every pose that the search is asked about, the proxy's too.
struct WorkspaceBox {
  std::array<double, 3> min_m{0, 0, 0}, max_m{0, 0, 0};
};

/// Part of an edge that other pieces of its body leave open, and the outward normals there.
struct ExposedArc {
  double begin = 0.0, end = 1.0;  ///< share of the way from EdgeRecord::vertex[0] to vertex[1]
  /// Unit normals at the ends of the arc, on the side of EdgeRecord::face[0] and face[1]; body
  /// frame.
  std::array<double, 3> from{0, 0, 0}, to{0, 0, 0};
};

using FragmentPolygon = std::vector<std::array<double, 3>>;

/// The features of a piece that the other pieces of the same body leave exposed. Hidden: no contact
/// of the part uses the feature, because there the part continues in another piece. Hidden is not
/// unreachable: a hidden feature may still hold the only plane that separates its piece.
struct PieceExposure {
  std::vector<bool> face_hidden, edge_hidden, vertex_hidden;  ///< numbered as in PieceTopology
  /// For each vertex: hidden, but an open edge of the piece ends there in the corner with another
  /// piece. A contact on the edge up to its end also goes into that other piece; its contact
  /// reaches to the vertex.
  std::vector<bool> edge_end;
  /// Exposed fragments of each face that is covered in part: convex polygons, counter-clockwise
  /// from outside, body frame [m], interiors disjoint. None for a face that is open or hidden as a
  /// whole.
  std::vector<std::vector<FragmentPolygon>> face_fragments;
  /// Open stretches of each edge; one from 0 to 1 over the whole arc where nothing covers it, none
  /// where it is hidden.
  std::vector<std::vector<ExposedArc>> edge_arcs;
  /// Directions d of each vertex's cone {n : n.d <= 0 for all d}, unit, body frame, where other
  /// pieces at the vertex narrow it; none where they do not, or where it is hidden.
  std::vector<std::vector<std::array<double, 3>>> vertex_cone;
};

/// Features of one piece that a contact of the part may use; the others lie where the part goes on
/// in another piece. Numbered as in PieceTopology.
struct OpenFeatures {
  std::vector<bool> faces, edges, vertices;
};

/// Marks of the nodes of one pair, by node number (PairRecord).
struct PairMarks {
  /// False: the node is applicable in no orientation of the envelope, or can never be near in the
  /// workspace. It may be deleted under every law.
  std::vector<bool> reachable;
  /// False: no contact of the two parts uses the node. Never a force, never an application point,
  /// never a plane imposed first; it may still separate.
  std::vector<bool> exposed;
  /// False: the pieces always stay farther apart than the exact band; no node is reachable then.
  bool near = true;
  [[nodiscard]] bool live(std::size_t node) const { return reachable[node] && exposed[node]; }
};

}  // namespace haptic::tools
