// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/stored_graphs.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace haptic::tools {
namespace {

constexpr std::uint64_t kNarrowNodes = std::numeric_limits<std::uint16_t>::max();
constexpr std::uint64_t kLongestList = std::numeric_limits<std::uint16_t>::max();
/// More would not fit the 32-bit positions of the lists.
constexpr std::uint64_t kMaxNeighborEntries = std::uint64_t{1} << 31;

}  // namespace

std::uint64_t graph_bytes(const GraphSize& size, bool wide) {
  const std::uint64_t number = wide ? sizeof(std::uint32_t) : sizeof(std::uint16_t);
  return size.nodes * (sizeof(NodeRecord) + sizeof(std::uint32_t)) + size.neighbor_entries * number;
}

bool needs_wide_lists(const GraphSize& size) { return size.nodes > kNarrowNodes; }

StoredGraphs choose_stored_graphs(const std::vector<GraphSize>& sizes,
                                  const std::vector<std::uint64_t>& largest_degrees,
                                  std::uint64_t budget_bytes) {
  std::vector<std::size_t> order(sizes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t l, std::size_t r) {
    return graph_bytes(sizes[l], false) < graph_bytes(sizes[r], false);
  });
  StoredGraphs result;
  result.stored.assign(sizes.size(), false);
  GraphSize sum;
  for (const std::size_t pair : order) {
    if (largest_degrees[pair] > kLongestList) continue;
    const GraphSize with{sum.nodes + sizes[pair].nodes,
                         sum.neighbor_entries + sizes[pair].neighbor_entries};
    const bool wide = result.wide || needs_wide_lists(sizes[pair]);
    const std::uint64_t bytes = graph_bytes(with, wide);
    if (bytes > budget_bytes || with.neighbor_entries > kMaxNeighborEntries) break;
    result.stored[pair] = true;
    result.wide = wide;
    result.bytes = bytes;
    sum = with;
  }
  return result;
}

}  // namespace haptic::tools
