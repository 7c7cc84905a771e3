// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Exact test whether the interiors of two convex pieces are disjoint (METHOD section 7,
/// part 3).

#include "tools/graph_compiler/polyhedron/chain.hpp"

namespace haptic::tools {

/// A convex piece prepared for separation tests.
struct PieceHull {
  std::vector<std::pair<std::uint32_t, int>> planes;  ///< plane and sign of each face
  std::vector<std::uint32_t> vertices;

  explicit PieceHull(const Solid& piece);
};

/// True if the interiors are disjoint: a face plane of one has the other on its outer side, else
/// (two crossing edges face each other) a plane spanned by one edge direction of each separates
/// them. Exact both ways: false means that interiors overlap. Both pieces convex with interior
/// points.
bool separated(ExactWorld& world, const Solid& a, const PieceHull& hull_a, const Solid& b,
               const PieceHull& hull_b);

}  // namespace haptic::tools
