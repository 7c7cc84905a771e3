// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Incidence tables of one convex piece: what the contact graph is made of and what the blob
/// stores. Indices are local to the piece and keep the numbering of the vertices and faces that
/// came in.

#include <cstdint>
#include <string>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/graph_compiler/graph/convex_piece.hpp"

namespace haptic::tools {

struct PieceTopology {
  std::uint32_t vertex_count = 0;
  std::vector<FaceRecord> faces;  ///< loop_begin counts from the piece's first loop entry
  std::vector<std::uint16_t> loop_vertices;      ///< by face, counter-clockwise from outside
  std::vector<std::uint16_t> loop_edges;         ///< entry k joins loop vertices k and k + 1
  std::vector<EdgeRecord> edges;                 ///< sorted by (v0, v1), v0 < v1
  std::vector<std::uint32_t> vertex_edge_begin;  ///< vertex_count + 1 entries
  std::vector<std::uint16_t> vertex_edges;       ///< ascending at each vertex

  /// The tables as the core sees them, without geometry. Valid while this object lives unchanged.
  [[nodiscard]] PieceView view() const;
};

/// Builds the tables and proves that the faces close up to one sphere: every edge between exactly
/// two faces in opposite directions, one component, V - E + F = 2, at least three edges at every
/// vertex. `body` supplies the planes, `place` starts the messages ("peg.stl: piece 3").
/// @throws InputError naming piece, element and defect. Cost: O(E log E).
PieceTopology build_topology(const Body& body, const ConvexPiece& piece, const std::string& place);

}  // namespace haptic::tools
