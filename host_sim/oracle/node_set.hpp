// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Sets of nodes of one pair, and the neighbor subgraph of a set (paper Sec. II-A). The rule that
/// makes nodes and arcs is rt_core/scene/graph_rule.hpp.

#include <cstdint>
#include <span>
#include <vector>

#include "rt_core/base/bounded_list.hpp"
#include "rt_core/scene/graph_rule.hpp"

namespace haptic::sim {

/// A set of nodes of one pair: a bit per node for "is it in", a list for "which". Memory is the
/// caller's; `marks` must hold a bit per node of the largest pair and be zero at first.
class NodeSet {
 public:
  NodeSet() = default;
  NodeSet(std::span<std::uint64_t> marks, std::span<std::uint32_t> list) noexcept
      : marks_(marks), list_(list) {}

  /// Adds `node`; false when it was in already or the list is full.
  bool insert(std::uint32_t node) noexcept {
    std::uint64_t& word = marks_[node / 64];
    const std::uint64_t bit = std::uint64_t{1} << (node % 64);
    if ((word & bit) != 0 || !list_.push(node)) return false;
    word |= bit;
    return true;
  }
  [[nodiscard]] bool contains(std::uint32_t node) const noexcept {
    return (marks_[node / 64] >> (node % 64) & 1u) != 0;
  }
  /// Empties the set. Cost: its size.
  void clear() noexcept {
    for (const std::uint32_t node : list_) marks_[node / 64] = 0;
    list_.clear();
  }
  [[nodiscard]] std::uint32_t size() const noexcept { return list_.size(); }
  [[nodiscard]] std::uint32_t operator[](std::uint32_t i) const noexcept { return list_[i]; }

 private:
  std::span<std::uint64_t> marks_;
  BoundedList<std::uint32_t> list_;
};

/// Adds `node` and its G-neighbors to `set` (paper Sec. II-A: neighbor subgraph). Cost: the degree
/// of the node.
inline void insert_neighborhood(const PairView& pair, std::uint32_t node, NodeSet& set) noexcept {
  set.insert(node);
  const NodeFeatures n = node_features(pair, node);
  for_each_neighbor(pair.a, pair.b, n.type, n.i, n.j,
                    [&](std::uint32_t neighbor) { set.insert(neighbor); });
}

/// Nodes of the neighbor subgraph of `nodes`: themselves and their G-neighbors (paper: 17 to 72 on
/// tetrahedron and box).
inline std::uint32_t neighborhood_size(const PairView& pair, std::span<const std::uint32_t> nodes) {
  const std::uint32_t count = pair.record.node_count;
  std::vector<std::uint64_t> marks(count / 64 + 1);
  std::vector<std::uint32_t> list(count);
  NodeSet set(marks, list);
  for (const std::uint32_t node : nodes) insert_neighborhood(pair, node, set);
  return set.size();
}

}  // namespace haptic::sim
