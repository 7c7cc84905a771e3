// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a stored contact graph states about itself, by arithmetic from its two pieces: largest
/// degree, and where in a list the neighbors on the same face stand. Written by the compiler,
/// checked by SceneView::open; the loop does not need it.

#include <cstddef>
#include <cstdint>

#include "rt_core/scene/graph_rule.hpp"

namespace haptic {

/// Where the neighbors on the same face stand in the ascending list of a node; what
/// NodeRecord::keep_begin and keep_count hold.
struct KeepRange {
  std::uint32_t begin = 0, count = 0;
};

/// Keep range of a node on feature `i` of A with `degree` neighbors `neighbor_at(k)`, ascending.
/// For type B it reaches from the first to the last neighbor on the same face: between them stand
/// those on the same vertex of A. Cost: the degree.
template <typename NeighborAt>
[[nodiscard]] KeepRange keep_range(const NodeNumbering& nodes, ContactType type, std::uint32_t i,
                                   std::uint32_t degree, const NeighborAt& neighbor_at) {
  KeepRange range;
  if (type == ContactType::kC) return range;
  const std::uint32_t row = type == ContactType::kA ? nodes.type_a(i, 0) : nodes.type_b(i, 0);
  const std::uint32_t type_end = nodes.count_a() + (type == ContactType::kB ? nodes.count_b() : 0);
  const std::uint32_t type_begin = type == ContactType::kB ? nodes.count_a() : 0;
  for (std::uint32_t k = 0; k < degree; ++k) {
    const std::uint32_t other = neighbor_at(k);
    if (other < type_begin || other >= type_end) continue;
    const bool same_row = other - row < (type == ContactType::kA ? nodes.nvb : nodes.nfb);
    const bool same_face = type == ContactType::kA ? same_row : !same_row;
    if (!same_face) continue;
    if (range.count == 0) range.begin = k;
    range.count = k - range.begin + 1;
  }
  return range;
}

/// Largest loop of the faces of a piece, largest degree of its vertices and largest |N_e(E)|.
struct LargestFeatures {
  std::uint32_t face = 0, vertex = 0, adjacent_edges = 0;
};
[[nodiscard]] inline LargestFeatures largest_features(const PieceView& piece) noexcept {
  LargestFeatures largest;
  const auto raise = [](std::uint32_t& to, std::size_t x) {
    if (x > to) to = static_cast<std::uint32_t>(x);
  };
  for (std::uint32_t f = 0; f < piece.face_count; ++f)
    raise(largest.face, piece.faces[f].loop_count);
  for (std::uint32_t v = 0; v < piece.vertex_count; ++v) {
    raise(largest.vertex, piece.edges_at(v).size());
  }
  for (std::uint32_t e = 0; e < piece.edge_count; ++e) {
    const EdgeRecord& edge = piece.edges[e];
    raise(largest.adjacent_edges,
          piece.edges_at(edge.vertex[0]).size() + piece.edges_at(edge.vertex[1]).size() - 2);
  }
  return largest;
}

/// Largest degree of the pair's graph: a face of l sides and a vertex of d edges have l + d + 2 l d
/// neighbors, a pair of edges the adjacent edges of both and eight more.
[[nodiscard]] constexpr std::uint64_t largest_degree(const LargestFeatures& a,
                                                     const LargestFeatures& b) noexcept {
  const auto face_vertex = [](std::uint64_t l, std::uint64_t d) { return l + d + 2 * l * d; };
  const std::uint64_t type_a = face_vertex(a.face, b.vertex);
  const std::uint64_t type_b = face_vertex(b.face, a.vertex);
  const std::uint64_t type_c = std::uint64_t{a.adjacent_edges} + b.adjacent_edges + 8;
  const std::uint64_t faces = type_a > type_b ? type_a : type_b;
  return faces > type_c ? faces : type_c;
}

}  // namespace haptic
