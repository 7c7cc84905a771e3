// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Unites convex pieces whose union is convex (METHOD section 5, "Merging").

#include "tools/graph_compiler/polyhedron/chain.hpp"

namespace haptic::tools {

/// Pieces A <= h <= B unite iff every vertex of A satisfies B's planes except h and vice versa:
/// then the union is the intersection of these half-spaces. Greedy, pairs with most planes in
/// common first, ties by position. Cost: quadratic in the number of pieces, a few signs per pair
/// that shares a plane.
std::vector<Solid> merge_pieces(ExactWorld& world, std::vector<Solid> pieces);

}  // namespace haptic::tools
