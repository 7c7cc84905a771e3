// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Pieces of solids that overlap, cut until no two of them do (METHOD section 6, option
/// "disjoint").

#include "tools/graph_compiler/polyhedron/chain.hpp"

namespace haptic::tools {

/// Convex pieces without common interior. Parts that an earlier solid covers are taken from the
/// later ones and kept in `removed`, for the certificate: pieces and removed parts of a solid
/// together are the solid, and every removed part lies in a piece.
struct DisjointPieces {
  std::vector<Solid> pieces;
  std::vector<std::uint32_t> piece_solid;
  std::vector<Solid> removed;
  std::vector<std::uint32_t> removed_solid;
};

/// Subtracts the pieces of earlier solids from those of later ones, plane by plane, and merges what
/// is left within each solid. Pieces of one solid must not overlap.
/// @throws WorkLimitReached, BrokenChain
DisjointPieces make_disjoint(ExactWorld& world, const std::vector<Solid>& pieces,
                             const std::vector<std::uint32_t>& piece_solid);

}  // namespace haptic::tools
