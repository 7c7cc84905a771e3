// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which pairs of a scene get their contact graph as stored lists, and what the lists take. The
/// others are formed on the fly from the incidence of their pieces, which gives the same graph.

#include <cstdint>
#include <string>
#include <vector>

#include "tools/graph_compiler/graph/pair_graph.hpp"

namespace haptic::tools {

/// Bytes that the stored graphs of a scene may take together, where the scene does not say.
inline constexpr std::uint64_t kDefaultGraphBytes = std::uint64_t{8} << 20;
/// Largest budget: positions in the stored lists have 32 bits.
inline constexpr std::uint64_t kMaxGraphBytes = std::uint64_t{1} << 32;

/// Largest degree to give for a pair whose graph shall not be stored.
inline constexpr std::uint64_t kNeverStored = UINT64_MAX;

/// Bytes of one pair's stored graph: nodes, list begins, neighbors of `wide` (32-bit) or 16-bit
/// numbers.
std::uint64_t graph_bytes(const GraphSize& size, bool wide);

/// A graph whose node numbers need 32 bits; one such makes all lists of the scene wide.
bool needs_wide_lists(const GraphSize& size);

struct StoredGraphs {
  std::vector<bool> stored;  ///< by pair
  bool wide = false;         ///< neighbors are 32-bit
  std::uint64_t bytes = 0;   ///< of all stored graphs
};

/// Smallest pairs first, ties by index, as long as all stored graphs together keep within
/// `budget_bytes`. `largest_degrees` by pair: a list beyond 65535 entries is never stored (its
/// record counts in 16 bits). Cost: O(pairs log pairs).
StoredGraphs choose_stored_graphs(const std::vector<GraphSize>& sizes,
                                  const std::vector<std::uint64_t>& largest_degrees,
                                  std::uint64_t budget_bytes);

}  // namespace haptic::tools
