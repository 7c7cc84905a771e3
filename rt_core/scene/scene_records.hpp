// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Elements of the tables of a compiled scene: bodies, pieces and their features, pairs and their
/// basic contacts; SectionId (scene_format.hpp) says which section holds which.

#include <cstdint>

#include "rt_core/base/scalar.hpp"

namespace haptic {

/// Vertices of a piece in kVertexLanes come in a multiple of this; the rest repeats vertex 0.
inline constexpr std::uint32_t kLanePadding = 8;
[[nodiscard]] constexpr std::uint32_t padded_lanes(std::uint32_t vertices) noexcept {
  return (vertices + kLanePadding - 1) / kLanePadding * kLanePadding;
}

/// PairRecord::node_begin of a pair whose graph is not stored: its nodes and arcs are formed from
/// the incidence tables of its two pieces (scene/graph_rule.hpp), which gives the same graph.
inline constexpr std::uint32_t kGraphNotStored = 0xFFFFFFFFu;

/// PairRecord::mark_begin of a pair that needs all of its nodes.
inline constexpr std::uint32_t kNotMarked = 0xFFFFFFFFu;

/// One rigid body. Geometry of the moving body is given in A's axes about the grip point; of a
/// static body in W's axes about `reference_m`.
struct BodyRecord {
  double
      reference_m[3];  ///< moving: grip point x_0^A in A's mesh frame; static: reference point in W
  double volume_m3;    ///< of the solid (pieces of a cover counted once each)
  double friction;     ///< static body: Coulomb coefficient against the moving body, 0 to 2;
                       ///< moving: 0
  std::uint32_t piece_begin, piece_count;
  std::uint32_t plane_begin, plane_count;
  std::uint32_t name_offset, name_bytes;  ///< in kText
};

struct PlaneRecord {
  Real normal[3];  ///< unit
  Real offset_m;   ///< normal . p = offset for points p of the plane, in the body's geometry frame
};

struct PieceRecord {
  std::uint32_t body;
  std::uint32_t vertex_begin, vertex_count;
  std::uint32_t face_begin, face_count;
  std::uint32_t edge_begin, edge_count;
  std::uint32_t loop_begin, loop_count;  ///< in kLoopVertices and kLoopEdges
  std::uint32_t reserved;
  double volume_m3;
  double radius_m;     ///< largest distance of a vertex from `centre_m`
  double centre_m[3];  ///< mean of the vertices, geometry frame: interior point for the verdict
  double reach_m;      ///< largest distance of a vertex from the frame's origin
  /// For every vertex and every unit direction in which no neighbour rises by epsilon: how much
  /// farther than D_near - epsilon the support of a near node's plane can lie behind it [m].
  double vertex_relax_m;
  /// Largest ratio, over all edges, of the height that the piece can rise over a plane through the
  /// edge to the height of the adjoining face that rises, while that is at most epsilon; >= 1.
  double edge_relax_ratio;
  std::uint32_t lane_begin;  ///< in kVertexLanes
  std::uint32_t lane_count;  ///< padded vertices: x at lane_begin, y and z one lane_count on each
};

struct FaceRecord {
  std::uint32_t plane;       ///< index within the body's planes
  std::int32_t sign;         ///< +1 or -1: outward normal = sign * plane normal
  std::uint32_t loop_begin;  ///< in kLoopVertices, absolute
  std::uint32_t loop_count;
  std::int32_t source_face;  ///< face of the user's mesh, -1 when a cut made it
};

/// Edge v0 < v1; edges of a piece are sorted by (v0, v1). v0 -> v1 is counter-clockwise round
/// face[0].
struct EdgeRecord {
  std::uint16_t vertex[2];
  std::uint16_t face[2];
  std::uint16_t apex[2];  ///< vertex of face[k] farthest from the edge's line
};

struct EdgeDirection {
  Real unit[3];  ///< from vertex[0] to vertex[1]
  Real length_m;
};

/// The arc of an edge on the Gauss sphere, between the normals of its two faces, extended at each
/// end by the angle at which the adjoining face rises by epsilon over a plane through the edge; the
/// whole circle (cosine -1, sine 0) where a face is too narrow to rise by epsilon. The arc is
/// `cos(t) mid + sin(t) side`, |t| <= the half angle, which is at most pi.
struct EdgeArc {
  Real mid[3], side[3];  ///< orthonormal, orthogonal to the edge; `side` towards face[1]
  Real cosine, sine;     ///< of the half angle
  /// Outward normal of face[k] times the distance of apex[k] from the edge's line [m].
  Real tilt[2][3];
  /// 1 where, as far as the arc reaches beyond face[k], no vertex rises farther over a plane
  /// through the edge than apex[k]; 0 where one does.
  Real apex_rules[2];
};

/// A pair (piece of A, piece of B) = one convex C-obstacle and its graph of basic contacts (paper
/// Sec. II-A). Node numbers: type A `f nVB + v`, type B `nFA nVB + v nFB + f`, type C `nFA nVB +
/// nVA nFB + e nEB + g`.
struct PairRecord {
  std::uint32_t piece_a, piece_b;
  std::uint32_t node_begin;  ///< in kNodes, or kGraphNotStored
  std::uint32_t node_count;
  std::uint32_t node_count_a;  ///< type A; then type B; the rest is type C
  std::uint32_t node_count_b;
  std::uint32_t max_degree;
  std::uint32_t near_capacity;       ///< of the near set
  std::uint32_t edge_pair_capacity;  ///< pairs of active edges that a search may test
  std::uint32_t mark_begin;          ///< in kNodeMarks, or kNotMarked
};

/// Features of a basic contact: face or vertex or edge of A, vertex or face or edge of B, within
/// their pieces. Neighbors of the same type with the same face (types A and B) lie among the
/// `keep_count` consecutive ones of its list from the `keep_begin`-th on: for type A these are all
/// of them and no others, for type B those with the same vertex of A stand between. None for type
/// C.
struct NodeRecord {
  std::uint16_t a, b;
  std::uint16_t keep_begin, keep_count;
};

static_assert(sizeof(BodyRecord) == 64 && sizeof(PieceRecord) == 112 && sizeof(FaceRecord) == 20);
static_assert(sizeof(EdgeRecord) == 12 && sizeof(PairRecord) == 40 && sizeof(NodeRecord) == 8);
static_assert(sizeof(PlaneRecord) == 4 * sizeof(Real) &&
              sizeof(EdgeDirection) == 4 * sizeof(Real) && sizeof(EdgeArc) == 16 * sizeof(Real));

}  // namespace haptic
