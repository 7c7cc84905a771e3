// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Capacities of a scene as functions of its counts: the compiler writes them, SceneView recomputes
/// and compares them, the core sizes its memory by them. One place for each formula.

#include <algorithm>
#include <cstdint>

#include "rt_core/scene/scene_format.hpp"

namespace haptic {

/// Cap on support pairs of one attempt of the pair verdict; a verdict has two attempts (warm,
/// cold).
inline constexpr std::uint32_t kMaxSupportPairsPerAttempt = 64;
inline constexpr std::uint32_t kMaxSupportPairsPerPair = 2 * kMaxSupportPairsPerAttempt;

/// Basic contacts that can share one C-plane when the faces with `face_a` and `face_b` vertices lie
/// on each other: every vertex of each and every pair of their edges (19 for tetrahedron and box,
/// 24 for two boxes).
constexpr std::uint64_t face_face_ties(std::uint64_t face_a, std::uint64_t face_b) noexcept {
  return face_a + face_b + face_a * face_b;
}

/// Capacity of a pair's near set: three such planes at one corner of the C-obstacle, and a margin
/// for the edge stars of their corners; never more than the pair has nodes.
constexpr std::uint32_t near_capacity(std::uint32_t node_count, std::uint32_t largest_face_a,
                                      std::uint32_t largest_face_b) noexcept {
  return static_cast<std::uint32_t>(
      std::min<std::uint64_t>(node_count, 3 * face_face_ties(largest_face_a, largest_face_b) + 16));
}

/// Bound on the nodes of a neighbor subgraph: the near nodes and all their neighbors (paper Sec.
/// II-A).
constexpr std::uint32_t neighborhood_capacity(std::uint32_t node_count, std::uint32_t near_cap,
                                              std::uint32_t max_degree) noexcept {
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(
      node_count, std::uint64_t{near_cap} * (std::uint64_t{max_degree} + 1)));
}

/// Bound on node evaluations of one pair in one tick: the local search visits a node at most once
/// and stays within the pair; the exhaustive search visits every node twice (value, then near set);
/// snapping adds one per near node.
constexpr std::uint64_t nodes_evaluated_bound(std::uint32_t node_count,
                                              std::uint32_t near_cap) noexcept {
  return 3 * std::uint64_t{node_count} + near_cap;
}

/// Adds one pair to the scene's totals (saturating).
constexpr void add_pair(SceneCapacity& c, const PairRecord& pair) noexcept {
  constexpr std::uint64_t kMax = UINT32_MAX;
  c.pair_count += 1;
  c.largest_pair_nodes = std::max(c.largest_pair_nodes, pair.node_count);
  c.largest_near = std::max(c.largest_near, pair.near_capacity);
  c.largest_neighborhood = std::max(c.largest_neighborhood, pair.neighborhood_capacity);
  c.total_near =
      static_cast<std::uint32_t>(std::min(kMax, std::uint64_t{c.total_near} + pair.near_capacity));
  c.max_nodes_evaluated = static_cast<std::uint32_t>(std::min(
      kMax, c.max_nodes_evaluated + nodes_evaluated_bound(pair.node_count, pair.near_capacity)));
  c.max_support_pairs = static_cast<std::uint32_t>(
      std::min(kMax, std::uint64_t{c.max_support_pairs} + kMaxSupportPairsPerPair));
}

/// Adds one piece of the moving body.
constexpr void add_moving_piece(SceneCapacity& c, const PieceRecord& piece) noexcept {
  c.moving_vertices += piece.vertex_count;
  c.moving_faces += piece.face_count;
  c.moving_edges += piece.edge_count;
}

}  // namespace haptic
