// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The pairs of a scene of many pieces. They are not listed, for a list would grow with the pieces
/// of the one part times those of the other: each is formed from its two pieces when it comes near.
/// Law proxy alone can do so; a search at the goal looks at every pair of the scene.

#include <algorithm>
#include <cstdint>
#include <span>

#include "rt_core/scene/scene_format.hpp"

namespace haptic {

/// A pair of pieces in its scene: in the list, or of the pieces' numbers where there is none.
using PairIndex = std::uint64_t;
inline constexpr PairIndex kNoPair = ~PairIndex{0};

/// Pairs that are listed, each with its own marks, however few pieces there are.
inline constexpr std::uint64_t kMostListedPairs = 4096;

/// True if the contact at the goal pose can be searched: every law but kProxy needs it.
constexpr bool has_goal_contact(const SceneParameters& p) noexcept {
  return p.law != LawId::kProxy || p.goal_contact != 0;
}

/// Some piece is a facet of a surface.
constexpr bool has_facets(std::span<const PieceRecord> pieces) noexcept {
  return std::any_of(pieces.begin(), pieces.end(), is_flat);
}

/// True if kPairs lists the pairs of a scene; else there is one of every piece of A with every
/// other one, in the order of the pieces. `facets`: some piece is one; such a scene has no search
/// at the goal.
constexpr bool lists_pairs(const SceneParameters& p, std::uint64_t pieces_a, std::uint64_t pieces_b,
                           bool facets) noexcept {
  return !facets && (pieces_a * pieces_b <= kMostListedPairs || has_goal_contact(p));
}

/// The record of a pair that is not listed. Its graph is not stored, its degree not counted, and
/// its marks are those of its pieces.
constexpr PairRecord formed_pair(std::uint32_t piece_a, const PieceRecord& a, std::uint32_t piece_b,
                                 const PieceRecord& b) noexcept {
  PairRecord pair{};
  pair.piece_a = piece_a;
  pair.piece_b = piece_b;
  pair.node_begin = kGraphNotStored;
  pair.node_count_a = a.face_count * b.vertex_count;
  pair.node_count_b = a.vertex_count * b.face_count;
  pair.node_count = pair.node_count_a + pair.node_count_b + a.edge_count * b.edge_count;
  // A face has no more vertices than its piece.
  pair.near_capacity = near_capacity(pair.node_count, a.vertex_count, b.vertex_count);
  pair.edge_pair_capacity = edge_pair_capacity(std::uint64_t{a.edge_count} * b.edge_count);
  pair.mark_begin = kNotMarked;
  return pair;
}

/// The most vertices, planes (as faces) and edges that any of the pieces has; the rest is zero.
constexpr PieceRecord largest_counts(std::span<const PieceRecord> pieces) noexcept {
  PieceRecord largest{};
  for (const PieceRecord& piece : pieces) {
    largest.vertex_count = std::max(largest.vertex_count, piece.vertex_count);
    largest.face_count = std::max(largest.face_count, plane_count(piece));
    largest.edge_count = std::max(largest.edge_count, piece.edge_count);
  }
  return largest;
}

/// Basic contacts of two pieces with these counts.
constexpr std::uint64_t basic_contacts(const PieceRecord& a, const PieceRecord& b) noexcept {
  return std::uint64_t{a.face_count} * b.vertex_count +
         std::uint64_t{a.vertex_count} * b.face_count + std::uint64_t{a.edge_count} * b.edge_count;
}

}  // namespace haptic
