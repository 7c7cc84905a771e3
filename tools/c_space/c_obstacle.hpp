// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The C-obstacle of one pair at one orientation as a polyhedron, built from its applicable basic
/// contacts (paper Sec. II): P(R) = B (+) (-R A), in W, about the grip point x_0^A.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "rt_core/proxy/near_pairs.hpp"
#include "tools/c_space/flat_pair.hpp"

namespace haptic::tools {

using Vector = Eigen::Vector3d;

/// One face of P(R): the C-faces of basic contacts that share a plane. At a generic orientation it
/// is the C-face of a single node; where edges or faces are parallel several nodes lie in it.
struct CFace {
  std::vector<std::uint32_t> nodes;  ///< ascending
  Vector normal = Vector::Zero();    ///< outward unit, W axes
  double offset_m = 0;               ///< normal . x of its points
  std::vector<Vector> polygon;       ///< counter-clockwise seen from outside, W [m]
  /// The part goes on in other pieces there: no contact of the face carries a force.
  bool hidden = false;
};

struct CObstacle {
  std::vector<CFace> faces;

  /// Face that holds `node`, or null.
  [[nodiscard]] const CFace* face_of(std::uint32_t node) const;
};

/// P(R) of pair number `pair` at the orientation of `pose_wa`.
[[nodiscard]] CObstacle make_c_obstacle(const SceneView& view, PairIndex pair, const Pose& pose_wa);

/// Convex hull of coplanar points, counter-clockwise about `normal`, corners only. Two points or
/// fewer are returned as they are; collinear points give the two ends.
[[nodiscard]] std::vector<Vector> planar_hull(std::span<const Vector> points, const Vector& normal);

/// Applicable nodes of the pair as placed (rt_core/METHOD.md section 2), ascending; tolerance in m.
[[nodiscard]] std::vector<std::uint32_t> applicable_nodes(const FlatPair& pair, double tolerance_m);

/// A node with its type and features: "44 B (v2, f0)"; of A first.
[[nodiscard]] std::string node_text(const PairView& pair, std::uint32_t node);

/// A C-obstacle near the point that stands for the part.
struct NearObstacle {
  PairIndex pair = 0;
  CObstacle obstacle;
  double distance_m = 0;  ///< of the point from the farthest of its planes; < 0: the pieces overlap
};
/// How many are looked for, and what is left out.
struct NearLimits {
  std::size_t most = 8;               ///< obstacles
  std::uint32_t most_nodes = 20'000;  ///< basic contacts of one
  std::uint32_t most_tried = 64;      ///< nearest by the spheres or boxes round their pieces
};
/// Finds the obstacles of the nearest pairs of a scene, by the trees that the servo loop has.
class ObstacleSearch {
 public:
  /// Builds the trees. `view` and its blob outlive this. Cost: O(n log n) of the pieces.
  ObstacleSearch(const SceneView& view, const NearLimits& limits);
  /// Nearest first. `too_large`: grows by the pairs that were near and have more than `most_nodes`.
  /// Cost: a visit of the trees, all nodes of the pairs that are tried.
  [[nodiscard]] std::vector<NearObstacle> nearest(const Pose& pose_wa, std::size_t& too_large);

 private:
  const SceneView* view_;
  NearLimits limits_;
  std::vector<std::uint64_t> memory_;
  NearPairs pairs_;
};

/// True if a basic contact can only separate: one of its features lies inside its part.
[[nodiscard]] bool only_separates(const PairView& pair, const Mat3& r_wa, std::uint32_t node,
                                  const Vector& normal);

/// Tolerance of applicability for pictures and counts: far above rounding, far below any feature.
inline constexpr double kApplicable_m = HAPTIC_REAL_IS_FLOAT ? 1e-7 : 1e-9;

[[nodiscard]] inline Vector vector_of(const Point& p) { return {p[0], p[1], p[2]}; }

}  // namespace haptic::tools
