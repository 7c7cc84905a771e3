// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Boundary chains of solids: sums with cancellation, canonical form, loops (METHOD section 4). A
/// chain is a multiset of directed edges; a face's chain has zero boundary and its interior on the
/// left.

#include "tools/graph_compiler/polyhedron/exact.hpp"

namespace haptic::tools {

using ChainEdge = std::pair<std::uint32_t, std::uint32_t>;
using Chain = std::vector<ChainEdge>;

/// A closed walk along a face's chain: vertices in order, each edge once.
using Loop = std::vector<std::uint32_t>;

/// Something about the boundary that no valid solid has (an open chain, a vertex missed by a line).
/// The attempt that meets it is given up; nothing wrong can come out, because the certificate does
/// not rest on these checks.
class BrokenChain : public std::runtime_error {
 public:
  explicit BrokenChain(const std::string& text) : std::runtime_error(text) {}
};

/// Cancels opposite edges and sorts what is left.
void cancel(Chain& chain);

/// Canonical form: one face per (plane, sign), by rising plane and sign, chains cancelled and
/// sorted, empty faces gone, `source_face` cleared. Two solids are the same set with the same
/// vertices iff their canonical forms are equal.
void normalise(Solid& solid);

/// Removes vertices with only two edges: they lie inside a straight edge. Keeps the canonical form.
void drop_straight_vertices(Solid& solid);

/// Loops of one face, each starting at its smallest vertex, in rising order. At a vertex that the
/// chain passes several times the leftmost turn is taken, so that areas that meet in that vertex
/// alone come out as loops of their own.
/// @throws BrokenChain if the chain is not closed.
std::vector<Loop> trace_loops(ExactWorld& world, const ExactFace& face);

/// True if the loop runs around its area (outer loop), false if it is the edge of a hole.
bool is_outer(ExactWorld& world, const ExactFace& face, const Loop& loop);

/// Where a point of the face's plane lies: +1 inside the area that the chain bounds, 0 on the
/// chain, -1 outside.
int locate_in_chain(const ExactWorld& world, const ExactFace& face, const Chain& chain,
                    const Rational3& point);

/// Vertices of a solid, rising, each once.
std::vector<std::uint32_t> vertices_of(const Solid& solid);

}  // namespace haptic::tools
