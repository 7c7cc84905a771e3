// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The contact graph of one pair as CSR lists, enumerated from the core's rule
/// (rt_core/scene/graph_rule.hpp).

#include <cstdint>
#include <vector>

#include "rt_core/scene/scene_view.hpp"

namespace haptic::tools {

struct PairGraph {
  std::uint32_t node_count_a = 0;  ///< type A (face, vertex); then type B; the rest is type C
  std::uint32_t node_count_b = 0;
  std::uint32_t max_degree = 0;
  std::vector<NodeRecord> nodes;
  std::vector<std::uint32_t> neighbor_begin;  ///< nodes.size() + 1 entries, from 0
  std::vector<std::uint32_t> neighbors;  ///< ascending at each node; every arc stored both ways
};

/// Sizes of a pair's graph, known before it is built.
struct GraphSize {
  std::uint64_t nodes = 0;
  std::uint64_t neighbor_entries = 0;  ///< twice the number of arcs
};

/// Exact, from degrees alone. Cost: O(V) of both pieces.
GraphSize graph_size(const PieceView& a, const PieceView& b);

/// Builds the graph; graph_size(a, b) must fit 32 bits, its largest degree 16. Cost: O(entries log
/// degree).
PairGraph build_pair_graph(const PieceView& a, const PieceView& b);

}  // namespace haptic::tools
