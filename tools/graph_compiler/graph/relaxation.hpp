// SPDX-License-Identifier: Apache-2.0
#pragma once
/// How far behind a plane the rest of a piece can lie when the features next to an edge or a vertex
/// rise over it by at most epsilon: the bounds edge_relax_ratio and vertex_relax_m, by which the
/// search knows that what it passes over cannot be near.

#include <cstdint>
#include <functional>
#include <vector>

#include "tools/graph_compiler/graph/edge_arcs.hpp"
#include "tools/graph_compiler/graph/scene_account.hpp"

namespace haptic::tools {

/// Largest ratio of the height of the piece to epsilon, the height of the adjoining face, at the
/// ends of the arcs. On an edge the ratio of the heights of a vertex and of an apex, sin(t - t_v) /
/// sin(t) up to a factor, rises with the turn t beyond the face's normal, so that the end is the
/// worst. On a full arc any height occurs: the width 2 `radius_m` of the piece over epsilon. So
/// ratio times epsilon bounds the height everywhere; ratio times the height of the face, off full
/// arcs. Rounded up. Cost: O(E V).
EdgeRelaxation edge_relaxation(const WidePiece& piece, const std::vector<WideArc>& arcs,
                               double epsilon_m, double radius_m);

/// A vertex b and its neighbors b_k: g(t) = the largest n.(v - b) over all vertices v and all unit
/// n with n.(b_k - b) <= t for every k. Exact except for rounding, which goes upwards: on the
/// region of the sphere that is left of t-circles about the neighbors, n.(v - b) is largest where n
/// points to v, or at the point of one circle nearest to that, or where two circles cross.
class VertexRise {
 public:
  VertexRise(const WidePiece& piece, std::uint32_t vertex);

  /// g(t) [m], t >= 0; rises with t. With more than kHeldNeighbors neighbors some are left out,
  /// which only makes it larger. Cost: V times degree dot products, mostly.
  [[nodiscard]] Wide largest(Wide t_m) const;
  /// Smallest distance of the vertex from a plane through three neighbors that has all others on
  /// its side [m]; from this t on, n may point into the piece and g is of the size of its width.
  /// Infinite with more than kHeldNeighbors. Cost: the fourth power of the degree.
  [[nodiscard]] Wide depth_m() const;

 private:
  [[nodiscard]] bool allowed(const Wide3& n, Wide t_m) const;

  std::vector<Wide3> edges_;   ///< b_k - b
  std::vector<Wide> lengths_;  ///< of edges_
  std::vector<Wide3> others_;  ///< v - b
  bool all_held_ = true;
};

/// Neighbors of one vertex that its bound takes into account.
inline constexpr std::size_t kHeldNeighbors = 128;
/// Steps of the grid over [0, epsilon] for pieces of up to kFineVertices vertices; one for larger
/// ones, which takes the bound up by epsilon at most.
inline constexpr int kRiseSteps = 16;
inline constexpr std::uint32_t kFineVertices = 2000;

/// epsilon plus the largest excess g(t_{i+1}) - t_i over the steps of t in [0, epsilon], over all
/// vertices: since g rises, no t in between has more. Rounded up. Cost: O(V^2 degree) and up to
/// kRiseSteps times that at vertices that may be the largest: seconds for thousands of vertices.
/// `progress` gets the fraction done.
VertexRelaxation vertex_relaxation(const WidePiece& piece, double epsilon_m,
                                   const std::function<void(double)>& progress = {});

}  // namespace haptic::tools
