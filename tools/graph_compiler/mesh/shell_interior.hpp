// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Point in polyhedron, in double, robust against rays through edges and corners.

#include <array>
#include <cstdint>
#include <optional>
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
  /// How often the chain runs round the point; absent where no ray decides it: the point is on the
  /// surface, or all rays pass an edge.
  std::optional<int> winding_of(const Point3& point) const;

 private:
  enum class Ray : std::uint8_t { kCrosses, kStartsOnSurface, kUndecided };
  Ray cast_ray(const Point3& point, const Point3& direction, int& winding) const;
  PointPlace by_solid_angle(const Point3& point) const;
  std::vector<Triangle> triangles_;
  double tolerance_m_;
  BoxTree tree_;
};

/// The winding number of facets that need not be closed: the solid angle that they fill, seen from
/// a point, in full turns. A whole number where they are closed; where they are torn it is near one
/// but close to the tear; half a turn right before a large sheet.
class OpenShellInterior {
 public:
  using Triangle = ShellInterior::Triangle;

  /// @param rim  triangles that close the facets: facets and rim are one closed chain.
  OpenShellInterior(std::vector<Triangle> facets, std::vector<Triangle> rim, double tolerance_m);

  /// Cost: as ShellInterior for facets and rim as a whole, and linear in the rim; linear in the
  /// facets where no ray decides.
  double winding_of(const Point3& point) const;

 private:
  std::vector<Triangle> facets_, rim_;
  ShellInterior whole_;
};

/// Distance of a point from a triangle [m].
double triangle_distance(const Point3& point, const ShellInterior::Triangle& triangle);

}  // namespace haptic::tools
