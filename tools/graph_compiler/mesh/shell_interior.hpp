// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Point in polyhedron, in double, robust against rays through edges and corners.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tools/graph_compiler/mesh/box_tree.hpp"

namespace haptic::tools {

enum class PointPlace : std::uint8_t { kOutside, kInside, kOnSurface };

/// A closed chain of triangles (polygons as fans: concave and bent ones are right too, because what
/// a fan covers outside of its polygon it covers twice with opposite signs). Winding number != 0 is
/// inside.
class ShellInterior {
 public:
  using Triangle = std::array<Point3, 3>;

  /// @param tolerance_m  points nearer to the surface are on it.
  ShellInterior(std::vector<Triangle> triangles, double tolerance_m);

  /// Signed crossings of a ray; a ray that passes an edge within the tolerance decides nothing and
  /// the next of three fixed directions is taken; last of all the solid angle, which needs no ray.
  /// Cost: O(log n) as a rule, O(n) at worst.
  PointPlace place_of(const Point3& point) const;

 private:
  bool cast_ray(const Point3& point, const Point3& direction, PointPlace& place) const;
  PointPlace by_solid_angle(const Point3& point) const;
  std::vector<Triangle> triangles_;
  double tolerance_m_;
  BoxTree tree_;
};

/// Distance of a point from a triangle [m].
double triangle_distance(const Point3& point, const ShellInterior::Triangle& triangle);

}  // namespace haptic::tools
