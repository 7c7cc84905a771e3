// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The Hausdorff distance between two triangulated surfaces, bounded on both sides: the largest
/// distance of any point of either surface, inside triangles too, from the other surface.

#include <vector>

#include "tools/graph_compiler/mesh/box_tree.hpp"
#include "tools/graph_compiler/simplify/face_triangles.hpp"

namespace haptic::tools {

struct SurfaceDistance {
  double at_most_m = 0.0;    ///< proved: no point of either surface is farther from the other
  double at_least_m = 0.0;   ///< reached by a point, to within rounding
  Point3 farthest{0, 0, 0};  ///< that point
  bool complete = true;      ///< false: given up at the work limit; the bounds hold, but are wide
};

/// Cuts `t` along the border of `other` (the plane through one of its edges, upright on it) that
/// leaves the most of `t` on both sides; the parts are appended to `out`. False: no border does.
bool cut_at_border(const FaceTriangle& t, const FaceTriangle& other,
                   std::vector<FaceTriangle>& out);
/// Cuts `t` through the middle of its longest side.
void halve(const FaceTriangle& t, std::vector<FaceTriangle>& out);

/// Distances of points from one surface.
class SurfaceMeasure {
 public:
  /// `guess_m`: distances of about this size are found fastest.
  SurfaceMeasure(const std::vector<FaceTriangle>& triangles, double guess_m);
  /// Distance of a point; `which` receives the index of a nearest triangle. Cost: O(log n).
  double distance(const Point3& point, std::uint32_t* which = nullptr) const;
  [[nodiscard]] const std::vector<FaceTriangle>& triangles() const { return triangles_; }

 private:
  const std::vector<FaceTriangle>& triangles_;
  BoxTree tree_;
  double guess_;
};

struct DistanceLimits {
  double relative = 1.0e-3;  ///< at_most_m - at_least_m is at most this part of at_most_m,
  double absolute_m = 0.0;   ///< or this length, whichever is larger
  std::size_t max_parts = 20'000'000;  ///< triangles looked at
};

/// Branch and bound. The distance from a triangle t of the other surface is a convex function of
/// the point, so over a part of a triangle it is at most the largest of its three corner values;
/// the least of these over t bounds the distance from the surface. Parts whose bound is not within
/// the tolerance of the largest corner value found so far are cut along the borders of the nearest
/// triangle, or in half. Bounds carry a margin for the roundings of cutting and measuring.
/// Cost: about 2 us per part; parts grow with the length of all edges over the distance.
SurfaceDistance hausdorff_distance(const std::vector<FaceTriangle>& a,
                                   const std::vector<FaceTriangle>& b,
                                   const DistanceLimits& limits);

}  // namespace haptic::tools
