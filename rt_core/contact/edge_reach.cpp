// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/edge_reach.hpp"

#include <cmath>

#include "rt_core/contact/contact_identity.hpp"

namespace haptic {
namespace {

/// An end of an edge of one piece.
struct EdgeEnd {
  std::uint32_t piece = 0, edge = 0, vertex = 0;
};

/// The edge of another piece that goes on from `end`, seen from its far side; false: none does.
bool go_on(const SceneView& scene, const BodyRecord& body, EdgeEnd& end) noexcept {
  const PieceView from = scene.piece(end.piece);
  if (from.source_vertices[end.vertex] >= 0) return false;
  const auto planes = edge_identity(from, end.edge);
  const Vec3 at = from.vertex(end.vertex);
  const Vec3 along = at - from.vertex(from.other_end(end.edge, end.vertex));
  for (std::uint32_t p = body.piece_begin; p < body.piece_begin + body.piece_count; ++p) {
    if (p == end.piece) continue;
    const PieceView piece = scene.piece(p);
    for (std::uint32_t e = 0; e < piece.edge_count; ++e) {
      if (edge_identity(piece, e) != planes) continue;
      for (const std::uint32_t v : {piece.edges[e].vertex[0], piece.edges[e].vertex[1]}) {
        const std::uint32_t far = piece.other_end(e, v);
        if (Vec3(piece.vertex(v)) != at || (piece.vertex(far) - at).dot(along) <= 0) continue;
        end = {p, e, far};
        return true;
      }
    }
  }
  return false;
}

Real reach_of(const SceneView& scene, const BodyRecord& body, const EdgeEnd& near_end) noexcept {
  const PieceView piece = scene.piece(near_end.piece);
  const Vec3 from = piece.vertex(near_end.vertex);
  EdgeEnd end{near_end.piece, near_end.edge, piece.other_end(near_end.edge, near_end.vertex)};
  const Real length2 = (piece.vertex(end.vertex) - from).squaredNorm();
  bool longer = false;
  for (std::uint32_t k = 1; k < body.piece_count && go_on(scene, body, end); ++k) longer = true;
  if (!longer) return 1;
  return std::sqrt((scene.piece(end.piece).vertex(end.vertex) - from).squaredNorm() / length2);
}

}  // namespace

void measure_edge_reach(const SceneView& scene, std::span<EdgeReach> reach) noexcept {
  for (const BodyRecord& body : scene.bodies()) {
    for (std::uint32_t p = body.piece_begin; p < body.piece_begin + body.piece_count; ++p) {
      const PieceView piece = scene.piece(p);
      for (std::uint32_t e = 0; e < piece.edge_count; ++e) {
        for (std::size_t k = 0; k < 2; ++k) {
          reach[piece.record->edge_begin + e].from[k] =
              reach_of(scene, body, {p, e, piece.edges[e].vertex[k]});
        }
      }
    }
  }
}

std::uint32_t edge_count_of(const SceneView& scene) noexcept {
  std::uint32_t count = 0;
  for (const PieceRecord& piece : scene.pieces()) count += piece.edge_count;
  return count;
}

}  // namespace haptic
