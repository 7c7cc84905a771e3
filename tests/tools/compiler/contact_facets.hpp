// SPDX-License-Identifier: Apache-2.0
#pragma once
/// An independent view of a pair for tests: nodes, the Appendix's arcs by sets, and the facets of
/// the C-obstacle by brute force over all vertices. Uses the body's doubles, never the tables under
/// test.

#include <array>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "tests/support/shapes.hpp"

namespace haptic::test {

using Pair = std::pair<std::uint32_t, std::uint32_t>;

/// Incidence of one convex piece as plain sets.
struct Incidence {
  explicit Incidence(const tools::ConvexPiece& piece);
  std::vector<Point> vertices;
  std::vector<std::vector<std::uint32_t>> faces;  ///< loops
  std::vector<Pair> edges;                        ///< (low, high), sorted
  std::vector<std::set<std::uint32_t>> face_vertices, face_edges, vertex_faces, vertex_edges;
};

/// The contact graph of two pieces by the Appendix, symmetrised: set of (node, node) with both
/// orders.
struct ReferenceGraph {
  ReferenceGraph(const Incidence& a, const Incidence& b);
  std::uint32_t node_count = 0, count_a = 0, count_b = 0;
  std::set<Pair> arcs;

 private:
  void add(std::uint32_t u, std::uint32_t v);
};

/// A facet of P(R): a node whose plane supports the C-obstacle, with the vertices (of A, of B) that
/// lie on it.
struct Facet {
  std::uint32_t node = 0;
  std::set<Pair> corners;
};

/// All facets at rotation `q_wxyz` of A, by comparing every node's plane with the support of all
/// vertices. Only for orientations without parallel features.
std::vector<Facet> facets_of(const tools::ConvexPiece& a, const tools::ConvexPiece& b,
                             const std::array<double, 4>& q_wxyz);

}  // namespace haptic::test
