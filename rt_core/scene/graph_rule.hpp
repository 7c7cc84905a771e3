// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Nodes and arcs of the contact graph of one pair (paper Sec. II-A and Appendix; METHOD section
/// 3). Nodes: type A (face of A, vertex of B) `f nVB + v`; type B (vertex of A, face of B) `nFA nVB
/// + v nFB + f`; type C (edge of A, edge of B) `nFA nVB + nVA nFB + e nEB + g`. The Appendix's arcs
/// are taken both ways.

#include <cstdint>

#include "rt_core/scene/scene_view.hpp"

namespace haptic {

/// The three types of basic contacts (paper Sec. II-A).
enum class ContactType : std::uint8_t { kA, kB, kC };

/// Counts that number the nodes of a pair.
struct NodeNumbering {
  std::uint32_t nfa, nva, nea, nfb, nvb, neb;

  [[nodiscard]] constexpr std::uint32_t count_a() const noexcept { return nfa * nvb; }
  [[nodiscard]] constexpr std::uint32_t count_b() const noexcept { return nva * nfb; }
  [[nodiscard]] constexpr std::uint64_t count() const noexcept {
    return std::uint64_t{nfa} * nvb + std::uint64_t{nva} * nfb + std::uint64_t{nea} * neb;
  }
  [[nodiscard]] constexpr std::uint32_t type_a(std::uint32_t face_a,
                                               std::uint32_t vertex_b) const noexcept {
    return face_a * nvb + vertex_b;
  }
  [[nodiscard]] constexpr std::uint32_t type_b(std::uint32_t vertex_a,
                                               std::uint32_t face_b) const noexcept {
    return count_a() + vertex_a * nfb + face_b;
  }
  [[nodiscard]] constexpr std::uint32_t type_c(std::uint32_t edge_a,
                                               std::uint32_t edge_b) const noexcept {
    return count_a() + count_b() + edge_a * neb + edge_b;
  }
};

[[nodiscard]] inline NodeNumbering numbering(const PieceView& a, const PieceView& b) noexcept {
  return {a.face_count, a.vertex_count, a.edge_count, b.face_count, b.vertex_count, b.edge_count};
}

[[nodiscard]] inline ContactType contact_type(const PairRecord& pair, std::uint32_t node) noexcept {
  if (node < pair.node_count_a) return ContactType::kA;
  return node < pair.node_count_a + pair.node_count_b ? ContactType::kB : ContactType::kC;
}

/// Type of a node and its features within their pieces.
struct NodeFeatures {
  ContactType type;
  std::uint32_t i, j;  ///< of A, of B
};

/// Features of `node`, by arithmetic: needs no stored table. Cost: one division.
[[nodiscard]] inline NodeFeatures node_features(const PairView& pair, std::uint32_t node) noexcept {
  const PairRecord& r = pair.record;
  const ContactType type = contact_type(r, node);
  switch (type) {
    case ContactType::kA:
      return {type, node / pair.b.vertex_count, node % pair.b.vertex_count};
    case ContactType::kB:
      node -= r.node_count_a;
      return {type, node / pair.b.face_count, node % pair.b.face_count};
    case ContactType::kC:
      node -= r.node_count_a + r.node_count_b;
      break;
  }
  return {type, node / pair.b.edge_count, node % pair.b.edge_count};
}

/// Number of node (type, i, j).
[[nodiscard]] inline std::uint32_t node_number(const PairView& pair, ContactType type,
                                               std::uint32_t i, std::uint32_t j) noexcept {
  const NodeNumbering nodes = numbering(pair.a, pair.b);
  return type == ContactType::kA   ? nodes.type_a(i, j)
         : type == ContactType::kB ? nodes.type_b(i, j)
                                   : nodes.type_c(i, j);
}

/// Calls `visit(edge)` for N_e(E): the edges that share a vertex with edge `e`, without `e`.
template <typename Visit>
void for_each_adjacent_edge(const PieceView& piece, std::uint32_t e, const Visit& visit) {
  for (const std::uint16_t end : piece.edges[e].vertex) {
    for (const std::uint16_t other : piece.edges_at(end)) {
      if (other != e) visit(std::uint32_t{other});
    }
  }
}

/// Calls `visit(face)` for N_f(F): the faces across the edges of face `f`.
template <typename Visit>
void for_each_adjacent_face(const PieceView& piece, std::uint32_t f, const Visit& visit) {
  for (const std::uint16_t e : piece.face_edges(f)) {
    const EdgeRecord& edge = piece.edges[e];
    visit(std::uint32_t{edge.face[0] == f ? edge.face[1] : edge.face[0]});
  }
}

/// Calls `visit(face)` for N_f(V): the faces round vertex `v`. Each face at v has exactly one edge
/// at v that enters it counter-clockwise with v as its start, which makes every face come once.
template <typename Visit>
void for_each_face_at(const PieceView& piece, std::uint32_t v, const Visit& visit) {
  for (const std::uint16_t e : piece.edges_at(v)) {
    const EdgeRecord& edge = piece.edges[e];
    visit(std::uint32_t{edge.vertex[0] == v ? edge.face[0] : edge.face[1]});
  }
}

/// Calls `visit(node)` for every G-neighbor of node (type, i, j), each once, in no particular
/// order. The factored form of the graph: per-body incidence, products formed on the fly. Cost: the
/// degree of the node.
template <typename Visit>
void for_each_neighbor(const PieceView& a, const PieceView& b, ContactType type, std::uint32_t i,
                       std::uint32_t j, const Visit& visit) {
  const NodeNumbering nodes = numbering(a, b);
  switch (type) {
    case ContactType::kA:  // Appendix step 1
      for_each_adjacent_face(a, i, [&](std::uint32_t f) { visit(nodes.type_a(f, j)); });
      for (const std::uint16_t e : b.edges_at(j)) visit(nodes.type_a(i, b.other_end(e, j)));
      for (const std::uint16_t v : a.face_vertices(i)) {
        for_each_face_at(b, j, [&](std::uint32_t f) { visit(nodes.type_b(v, f)); });
      }
      for (const std::uint16_t e : a.face_edges(i)) {
        for (const std::uint16_t g : b.edges_at(j)) visit(nodes.type_c(e, g));
      }
      break;
    case ContactType::kB:  // Appendix step 2; type A by symmetry of step 1
      for (const std::uint16_t e : a.edges_at(i)) visit(nodes.type_b(a.other_end(e, i), j));
      for_each_adjacent_face(b, j, [&](std::uint32_t f) { visit(nodes.type_b(i, f)); });
      for (const std::uint16_t e : a.edges_at(i)) {
        for (const std::uint16_t g : b.face_edges(j)) visit(nodes.type_c(e, g));
      }
      for_each_face_at(a, i, [&](std::uint32_t f) {
        for (const std::uint16_t v : b.face_vertices(j)) visit(nodes.type_a(f, v));
      });
      break;
    case ContactType::kC:  // Appendix step 3; types A and B by symmetry of steps 1 and 2
      for_each_adjacent_edge(b, j, [&](std::uint32_t g) { visit(nodes.type_c(i, g)); });
      for_each_adjacent_edge(a, i, [&](std::uint32_t e) { visit(nodes.type_c(e, j)); });
      for (const std::uint16_t f : a.edges[i].face) {
        for (const std::uint16_t v : b.edges[j].vertex) visit(nodes.type_a(f, v));
      }
      for (const std::uint16_t v : a.edges[i].vertex) {
        for (const std::uint16_t f : b.edges[j].face) visit(nodes.type_b(v, f));
      }
      break;
  }
}

/// Calls `visit(node)` for every G-neighbor of node (type, i, j) of the pair, each once: from its
/// stored list, ascending, where the pair has one, else formed, in no particular order. The sets
/// are the same. Cost: the degree of the node.
template <typename Visit>
void for_each_graph_neighbor(const PairView& pair, ContactType type, std::uint32_t i,
                             std::uint32_t j, const Visit& visit) {
  if (!pair.has_lists()) {
    for_each_neighbor(pair.a, pair.b, type, i, j, visit);
    return;
  }
  const std::uint32_t node = node_number(pair, type, i, j);
  const std::uint32_t degree = pair.neighbors.count(node);
  for (std::uint32_t k = 0; k < degree; ++k) visit(pair.neighbors.at(node, k));
}

/// Calls `visit(vertex)` for the neighbors of node (type, i, j) on the same face: type A, the
/// vertices of B next to its vertex; type B, the vertices of A next to its vertex; type C has none.
/// The node applies when none of them rises over its plane (METHOD section 2). Each once; ascending
/// where the graph is stored. Cost: the degree of the vertex; type B of a stored graph passes its
/// face's neighbors too.
template <typename Visit>
void for_each_face_neighbor(const PairView& pair, ContactType type, std::uint32_t i,
                            std::uint32_t j, const Visit& visit) {
  if (type == ContactType::kC) return;
  if (!pair.has_lists()) {
    const PieceView& piece = type == ContactType::kA ? pair.b : pair.a;
    const std::uint32_t v = type == ContactType::kA ? j : i;
    for (const std::uint16_t e : piece.edges_at(v)) visit(piece.other_end(e, v));
    return;
  }
  const NodeNumbering nodes = numbering(pair.a, pair.b);
  const std::uint32_t node = type == ContactType::kA ? nodes.type_a(i, j) : nodes.type_b(i, j);
  const std::uint32_t begin = pair.nodes[node].keep_begin;
  const std::uint32_t end = begin + pair.nodes[node].keep_count;
  const std::uint32_t row = node - j;  // first node with the same feature of A
  for (std::uint32_t k = begin; k < end; ++k) {
    const std::uint32_t other = pair.neighbors.at(node, k);
    if (type == ContactType::kA) {
      visit(other - row);
    } else if (other - row >= nodes.nfb) {  // not the same vertex of A; wraps below `row`
      visit((other - nodes.count_a()) / nodes.nfb);
    }
  }
}

}  // namespace haptic
