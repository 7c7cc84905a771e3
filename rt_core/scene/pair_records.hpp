// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Bytes of the tables of pairs and of their basic contacts (scene_format.hpp), and the capacities
/// that a pair states. One place for each formula.

#include <algorithm>
#include <cstdint>

namespace haptic {

/// PairRecord::node_begin of a pair whose graph is not stored: its nodes and arcs are formed from
/// the incidence tables of its two pieces (scene/graph_rule.hpp), which gives the same graph.
inline constexpr std::uint32_t kGraphNotStored = 0xFFFFFFFFu;

/// PairRecord::mark_begin of a pair that needs all of its nodes.
inline constexpr std::uint32_t kNotMarked = 0xFFFFFFFFu;

/// A pair (piece of A, piece of B) = one convex C-obstacle and its graph of basic contacts (paper
/// Sec. II-A). Node numbers: type A `f nVB + v`, type B `nFA nVB + v nFB + f`, type C `nFA nVB +
/// nVA nFB + e nEB + g`.
struct PairRecord {
  std::uint32_t piece_a, piece_b;
  std::uint32_t node_begin;  ///< in kNodes, or kGraphNotStored
  std::uint32_t node_count;
  std::uint32_t node_count_a;  ///< type A; then type B; the rest is type C
  std::uint32_t node_count_b;
  std::uint32_t max_degree;
  std::uint32_t near_capacity;       ///< of the near set
  std::uint32_t edge_pair_capacity;  ///< pairs of active edges that a search may test
  std::uint32_t mark_begin;          ///< in kNodeMarks, or kNotMarked
};

/// Features of a basic contact: face or vertex or edge of A, vertex or face or edge of B, within
/// their pieces. Neighbors of the same type with the same face (types A and B) lie among the
/// `keep_count` consecutive ones of its list from the `keep_begin`-th on: for type A these are all
/// of them and no others, for type B those with the same vertex of A stand between. None for type
/// C.
struct NodeRecord {
  std::uint16_t a, b;
  std::uint16_t keep_begin, keep_count;
};

/// Pairs of edges that one pair may test in one tick. Every pair with no more than that many is
/// exact at every pose; measured on hulls of 200 vertices: at most 200 after the first tick.
inline constexpr std::uint32_t kMaxEdgePairs = 16384;

/// Pairs with no more nodes than this have room for all of them in their near set.
inline constexpr std::uint32_t kSmallPairNodes = 1024;

/// Basic contacts that can share one C-plane when the faces with `face_a` and `face_b` vertices lie
/// on each other: every vertex of each and every pair of their edges (19 for tetrahedron and box,
/// 24 for two boxes).
constexpr std::uint64_t face_face_ties(std::uint64_t face_a, std::uint64_t face_b) noexcept {
  return face_a + face_b + face_a * face_b;
}

/// Capacity of the near set of a pair with `node_count` live nodes: all of a small pair; else three
/// planes of ties at one corner of the C-obstacle, a margin for the edge stars of their corners,
/// and never more than the pair has nodes.
constexpr std::uint32_t near_capacity(std::uint32_t node_count, std::uint32_t largest_face_a,
                                      std::uint32_t largest_face_b) noexcept {
  if (node_count <= kSmallPairNodes) return node_count;
  const std::uint64_t ties = 3 * face_face_ties(largest_face_a, largest_face_b) + 16;
  return static_cast<std::uint32_t>(
      std::min<std::uint64_t>(node_count, std::max<std::uint64_t>(kSmallPairNodes, ties)));
}

/// Pairs of active edges that a search may test, of a pair with as many reachable ones.
constexpr std::uint32_t edge_pair_capacity(std::uint64_t edge_pairs) noexcept {
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(kMaxEdgePairs, edge_pairs));
}

}  // namespace haptic
