// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Points, arcs and convex polygons of the unit sphere, and the angles between them: the sets of
/// outward normals of faces, edges and vertices (METHOD section 11).

#include <array>
#include <vector>

namespace haptic::tools {

using Direction = std::array<double, 3>;  ///< unit vector

/// The shorter great arc from `from` to `to`, shorter than pi: the normals of a convex edge.
struct SphericalArc {
  Direction from{}, to{};
  Direction pole{};  ///< unit, from x to
};
SphericalArc spherical_arc(const Direction& from, const Direction& to);

/// {n : n.d <= 0 for every d of `sides`}: the normals of a convex vertex whose edges leave along
/// the sides.
struct SphericalPolygon {
  std::vector<Direction> sides;
  std::vector<Direction> corners;  ///< extreme rays
};
/// Finds the corners; sides that bound nothing are dropped. Cost: cube of the sides.
SphericalPolygon spherical_polygon(const std::vector<Direction>& sides);

/// Angle [rad] between two directions, accurate for small ones too.
double angle_between(const Direction& a, const Direction& b);
/// Least angle [rad] between a point of either set; 0 where they meet. Exact except for rounding,
/// at most 1e-7.
double angle_to(const Direction& p, const SphericalArc& arc);
double angle_to(const Direction& p, const SphericalPolygon& polygon);
double angle_to(const SphericalArc& a, const SphericalArc& b);

}  // namespace haptic::tools
