// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A convex polyhedron as the oracle sees it: vertices and face loops in long double, edges derived
/// here from the loops. Numbering of vertices and faces is the caller's; edges are pairs (i, j), i
/// < j, in lexicographic order (rt_core/METHOD.md section 3), so node numbers are those of the
/// compiled scene without reading its edge table.

#include <cstdint>
#include <vector>

#include "host_sim/oracle/wide.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic::sim {

/// An edge with the vertex of each adjoining face that lies farthest from the edge's line: over a
/// plane through the edge, all vertices of that face lie on the side of this one.
struct OracleEdge {
  std::uint32_t vertex[2] = {0, 0};
  std::uint32_t face[2] = {0, 0};
  std::uint32_t apex[2] = {0, 0};
};

struct OraclePiece {
  std::vector<WideVec> vertices;                  ///< [m]
  std::vector<std::vector<std::uint32_t>> loops;  ///< counter-clockwise seen from outside
  std::vector<WideVec> normals;                   ///< outward, unit, by face
  std::vector<OracleEdge> edges;
  std::vector<std::vector<std::uint32_t>>
      vertex_neighbors;  ///< vertices joined by an edge, ascending

  [[nodiscard]] std::uint64_t face_count() const { return loops.size(); }
};

/// Completes a piece from its vertices and loops; normals are computed from the vertices when
/// `normals` is empty.
/// @throws tools::InputError when an edge does not belong to exactly two faces or a loop names no
/// vertex.
[[nodiscard]] OraclePiece make_oracle_piece(std::vector<WideVec> vertices,
                                            std::vector<std::vector<std::uint32_t>> loops,
                                            std::vector<WideVec> normals = {});

/// The piece of a compiled scene, in its geometry frame. The planes are data of the scene (a plane
/// is shared by the pieces of a body), so their normals are taken from it and only brought to unit
/// length in long double.
[[nodiscard]] OraclePiece oracle_piece_of(const PieceView& piece);

/// Unit normal of a polygon: Newell's sum, relative to its first vertex.
[[nodiscard]] WideVec polygon_normal(const std::vector<WideVec>& vertices,
                                     const std::vector<std::uint32_t>& loop);

/// Largest distance of two vertices [m].
[[nodiscard]] Wide diameter(const std::vector<WideVec>& points);

}  // namespace haptic::sim
