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

/// Largest ratio of the height of the piece to that of the adjoining face at the ends of the arcs.
/// On an edge the ratio of the heights of a vertex and of an apex, sin(t - t_v) / sin(t) up to a
/// factor, rises with the turn t beyond the face's normal, so that the end is the worst. Where the
/// face cannot rise by epsilon, the piece's width 2 `radius_m` over epsilon at least. Rounded up.
/// Cost: O(E V).
EdgeRelaxation edge_relaxation(const WidePiece& piece, const std::vector<WideArc>& arcs,
                               double epsilon_m, double radius_m);

/// A vertex b with its neighbors b_k: upper bound of g(t) = the largest n.(v - b) over all vertices
/// v and unit n with n.(b_k - b) <= t. By duality t sum(lambda) + |v - b - sum lambda_k (b_k - b)|
/// bounds it for every lambda >= 0; tried are zero, cones of three neighbors, and, where the unit
/// length of n decides, one neighbor and pairs that are optimal for it.
class VertexCone {
 public:
  VertexCone(const WidePiece& piece, std::uint32_t vertex);

  /// Bound of g(t), t >= 0. With `refined` false only zero and cones of three are tried. Cost: V
  /// times the square of the vertex's degree at most.
  [[nodiscard]] Wide largest_rise(Wide t_m, bool refined) const;
  /// Smallest distance of the vertex from a plane through three neighbors below which all others
  /// lie: up to there the bound grows in proportion to t and needs no refinement.
  [[nodiscard]] Wide depth_m() const { return depth_m_; }

 private:
  struct Cone {
    std::uint32_t k[3];
    Wide3 row[3];  ///< inverse: lambda_i = row[i] . d
  };
  /// Lines t -> slope t + rest that bound one vertex.
  struct Line {
    Wide slope, rest_m, distance_m;
  };
  /// A unit normal over which neighbors k[0] and k[1] rise by t.
  struct Corner {
    Wide3 row[3];  ///< d = lambda_0 edge + lambda_1 edge + mu normal
  };
  [[nodiscard]] std::vector<Corner> corners_at(Wide t_m) const;
  [[nodiscard]] Wide one_neighbor(const Wide3& d, Wide t_m) const;
  void add_cones();

  std::vector<Wide3> edges_;   ///< b_k - b
  std::vector<Wide3> others_;  ///< v - b
  std::vector<Cone> cones_;
  std::vector<Line> lines_;  ///< by others_
  Wide depth_m_ = 0;
};

/// epsilon plus the largest excess g(t_{i+1}) - t_i over a grid of kRiseSteps steps of t in
/// [0, epsilon], over all vertices. Rounded up. Pieces of more than kRefinedVertices vertices are
/// bounded without refinement. Cost: O(V^2) where epsilon is below the depth of every vertex, else
/// up to kRiseSteps V^2 times a squared degree. `progress` is told the fraction done.
VertexRelaxation vertex_relaxation(const WidePiece& piece, double epsilon_m,
                                   const std::function<void(double)>& progress = {});

inline constexpr int kRiseSteps = 16;
inline constexpr std::uint32_t kRefinedVertices = 2000;

}  // namespace haptic::tools
