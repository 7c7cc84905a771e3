// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The counts of the paper's Sec. III: nodes and arcs of the graph, sizes of the neighbor subgraph
/// and of the local applicability subgraph.

#include <array>
#include <cstdint>
#include <map>
#include <string>

#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// Graph of tetrahedron and box.
struct GraphFacts {
  std::array<std::uint32_t, 3> nodes{};  ///< of types A, B, C
  std::uint32_t arcs = 0;
  std::array<std::uint32_t, 3> least_degree{}, largest_degree{};
};
[[nodiscard]] GraphFacts graph_facts();

/// Sizes of the neighbor subgraph that real ticks of the core evaluated, by situation.
struct NeighborhoodRange {
  std::uint64_t poses = 0;
  std::uint32_t least = UINT32_MAX, largest = 0;
  std::uint32_t most_near = 0;  ///< largest near subgraph
};
using NeighborhoodTable = std::map<std::string, NeighborhoodRange>;
[[nodiscard]] NeighborhoodTable neighborhood_table(std::uint32_t poses);

/// Name of the situation outside the paper's own: near C-faces of different planes.
inline constexpr const char* kSeveralPlanesRow = "near C-faces of several planes";

/// Sizes of the local applicability subgraph: share of poses by size, one histogram per delta.
struct LocalSizes {
  static constexpr std::array<double, 4> kDeltas_m = {0.001, 0.002, 0.005, 0.010};
  static constexpr std::size_t kSizes = 24;
  /// Classes of poses by their number of near nodes.
  enum Class : std::size_t { kOneNear, kUpToFourNear, kMoreNear, kClasses };
  std::uint64_t poses[kClasses] = {};
  std::uint64_t count[kClasses][kDeltas_m.size()][kSizes] = {};

  [[nodiscard]] double share_below(Class kind, std::size_t delta, std::size_t size) const;
  [[nodiscard]] std::size_t largest(Class kind, std::size_t delta) const;
};
[[nodiscard]] LocalSizes local_sizes(std::uint32_t poses);

[[nodiscard]] PartReport graph_part(const ReproductionSize& size);

}  // namespace haptic::sim
