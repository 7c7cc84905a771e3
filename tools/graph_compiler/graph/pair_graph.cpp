// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/pair_graph.hpp"

#include <algorithm>

#include "rt_core/scene/graph_limits.hpp"

namespace haptic::tools {
namespace {

/// Sum over edges of |N_e(E)| = sum over ends of (degree - 1) = sum over vertices of degree (degree
/// - 1).
std::uint64_t adjacent_edge_sum(const PieceView& p) {
  std::uint64_t sum = 0;
  for (std::uint32_t v = 0; v < p.vertex_count; ++v) {
    const std::uint64_t degree = p.edges_at(v).size();
    sum += degree * (degree - 1);
  }
  return sum;
}

}  // namespace

GraphSize graph_size(const PieceView& a, const PieceView& b) {
  const NodeNumbering n = numbering(a, b);
  const std::uint64_t ea = n.nea, eb = n.neb;
  GraphSize size;
  size.nodes = n.count();
  // Faces of a piece have 2E corners and 2E edges in all, vertices 2E edges and 2E faces: each
  // product of an N_x of A with one of B sums to 4 EA EB over the nodes of a type, two such
  // products in types A, B and C each.
  const std::uint64_t mixed = 2 * 4 * ea * eb;
  const std::uint64_t type_a = 2 * ea * n.nvb + 2 * eb * n.nfa + mixed;
  const std::uint64_t type_b = 2 * ea * n.nfb + 2 * eb * n.nva + mixed;
  const std::uint64_t type_c = ea * adjacent_edge_sum(b) + eb * adjacent_edge_sum(a) + mixed;
  size.neighbor_entries = type_a + type_b + type_c;
  return size;
}

PairGraph build_pair_graph(const PieceView& a, const PieceView& b) {
  const NodeNumbering n = numbering(a, b);
  PairGraph graph;
  graph.node_count_a = n.count_a();
  graph.node_count_b = n.count_b();
  const GraphSize size = graph_size(a, b);
  graph.nodes.reserve(size.nodes);
  graph.neighbor_begin.reserve(size.nodes + 1);
  graph.neighbors.reserve(size.neighbor_entries);
  graph.neighbor_begin.push_back(0);
  const auto add = [&](ContactType type, std::uint32_t i, std::uint32_t j) {
    const auto begin = static_cast<std::ptrdiff_t>(graph.neighbors.size());
    for_each_neighbor(a, b, type, i, j,
                      [&](std::uint32_t node) { graph.neighbors.push_back(node); });
    std::sort(graph.neighbors.begin() + begin, graph.neighbors.end());
    const auto end = static_cast<std::uint32_t>(graph.neighbors.size());
    const KeepRange keep = keep_range(
        n, type, i, end - graph.neighbor_begin.back(),
        [&](std::uint32_t k) { return graph.neighbors[static_cast<std::size_t>(begin) + k]; });
    graph.nodes.push_back({static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(j),
                           static_cast<std::uint16_t>(keep.begin),
                           static_cast<std::uint16_t>(keep.count)});
    graph.max_degree = std::max(graph.max_degree, end - graph.neighbor_begin.back());
    graph.neighbor_begin.push_back(end);
  };
  for (std::uint32_t f = 0; f < n.nfa; ++f) {
    for (std::uint32_t v = 0; v < n.nvb; ++v) add(ContactType::kA, f, v);
  }
  for (std::uint32_t v = 0; v < n.nva; ++v) {
    for (std::uint32_t f = 0; f < n.nfb; ++f) add(ContactType::kB, v, f);
  }
  for (std::uint32_t e = 0; e < n.nea; ++e) {
    for (std::uint32_t g = 0; g < n.neb; ++g) add(ContactType::kC, e, g);
  }
  return graph;
}

}  // namespace haptic::tools
