// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Do the solids of a scene overlap where the moving part lies, with its axes as at the start? From
/// the planes of faces and the directions across two edges of every pair of convex pieces, seams
/// between pieces included: one of them keeps two convex pieces apart if anything does. Surfaces of
/// the mesh alone would not do: a part that lies on a seam is as deep in the solid as the next
/// surface is far.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {

class SolidPlaces {
 public:
  /// Pieces of solids alone; the part is not turned. Depths to `touching_m` are no overlap.
  SolidPlaces(const SceneView& scene, double touching_m);

  /// True if two pieces overlap with the origin of the moving mesh at `p` in W.
  [[nodiscard]] bool overlaps(const Point3& p) const;

  /// Length of the shortest move that separates the pair of pieces that overlaps the most [m]; 0:
  /// none overlaps. Cost: for every pair that does, its pairs of edges times its corners. Beyond
  /// kMostEdgeDirections pairs of edges the planes of faces alone are looked at, and the depth is
  /// an upper bound.
  [[nodiscard]] double depth_m(const Point3& p) const;

  static constexpr std::size_t kMostEdgeDirections = 20'000;

 private:
  struct Piece {
    std::vector<Point3> corners, normals, edges;  ///< unit vectors, but the corners
    std::vector<double> offsets_m;                ///< of the faces
    vec::Box box;
  };
  /// Largest gap along the planes of the faces of both, the moving one shifted by `p`.
  [[nodiscard]] static double face_gap_m(const Piece& a, const Piece& b, const Point3& p,
                                         double enough_m);
  [[nodiscard]] static double edge_gap_m(const Piece& a, const Piece& b, const Point3& p,
                                         double enough_m);
  /// Radius of a ball about a corner or the middle of one that lies in the other: no direction has
  /// them overlap by less.
  [[nodiscard]] static double ball_m(const Piece& a, const Piece& b, const Point3& p);

  std::vector<Piece> moving_, fixed_;
  double touching_m_ = 0.0;
};

}  // namespace haptic::tools
