// SPDX-License-Identifier: Apache-2.0
#pragma once
/// How far the edges of a body's pieces go on in its other pieces, of a compiled scene or of one
/// that is being compiled. For the start, not for the loop.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/contact/contact_identity.hpp"
#include "rt_core/contact/edge_reach.hpp"

namespace haptic {

/// The edges of one body; `piece_at(p)` gives the PieceView of piece p of the scene.
template <typename PieceAt>
class UncutEdges {
 public:
  UncutEdges(const BodyRecord& body, const PieceAt& piece_at) noexcept
      : body_(body), piece_at_(piece_at) {}

  /// Fills the entries of the body's edges in the order of the edge table.
  void measure(std::span<EdgeReach> reach) const noexcept {
    for (std::uint32_t p = body_.piece_begin; p < body_.piece_begin + body_.piece_count; ++p) {
      const PieceView piece = piece_at_(p);
      for (std::uint32_t e = 0; e < piece.edge_count; ++e) {
        for (std::size_t k = 0; k < 2; ++k) {
          reach[piece.record->edge_begin + e].from[k] = reach_of({p, e, piece.edges[e].vertex[k]});
        }
      }
    }
  }

 private:
  /// An end of an edge of one piece.
  struct EdgeEnd {
    std::uint32_t piece = 0, edge = 0, vertex = 0;
  };

  /// The edge of another piece that goes on from `end`, seen from its far side; false: none does.
  bool go_on(EdgeEnd& end) const noexcept {
    const PieceView from = piece_at_(end.piece);
    if (from.source_vertices[end.vertex] >= 0) return false;
    const auto planes = edge_identity(from, end.edge);
    const Vec3 at = from.vertex(end.vertex);
    const Vec3 along = at - from.vertex(from.other_end(end.edge, end.vertex));
    for (std::uint32_t p = body_.piece_begin; p < body_.piece_begin + body_.piece_count; ++p) {
      if (p == end.piece) continue;
      const PieceView piece = piece_at_(p);
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

  Real reach_of(const EdgeEnd& near_end) const noexcept {
    const PieceView piece = piece_at_(near_end.piece);
    const Vec3 from = piece.vertex(near_end.vertex);
    EdgeEnd end{near_end.piece, near_end.edge, piece.other_end(near_end.edge, near_end.vertex)};
    const Real length2 = (piece.vertex(end.vertex) - from).squaredNorm();
    bool longer = false;
    for (std::uint32_t k = 1; k < body_.piece_count && go_on(end); ++k) longer = true;
    if (!longer) return 1;
    return std::sqrt((piece_at_(end.piece).vertex(end.vertex) - from).squaredNorm() / length2);
  }

  const BodyRecord& body_;
  const PieceAt& piece_at_;
};

}  // namespace haptic
