// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Walks on the stored contact graph of a pair: which nodes have been reached in this tick, and the
/// neighbor subgraph of a set of nodes. The rule that makes nodes and arcs is scene/graph_rule.hpp.

#include <cstdint>
#include <span>

#include "rt_core/base/bounded_list.hpp"
#include "rt_core/scene/graph_rule.hpp"

namespace haptic {

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
  const std::uint32_t degree = pair.neighbors.count(node);
  for (std::uint32_t k = 0; k < degree; ++k) set.insert(pair.neighbors.at(node, k));
}

}  // namespace haptic
