// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Planes through many points: the least-squares fit, and the digits of it beyond double.

#include <cmath>
#include <cstdint>
#include <vector>

#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/polyhedron/plane_fit.hpp"

namespace haptic::tools {

/// n . x = d, n unit.
struct FlatPlane {
  Point3 n{0, 0, 0};
  double d = 0.0;
  [[nodiscard]] double distance(const Point3& x) const { return std::abs(vec::dot(n, x) - d); }
};

/// Least-squares plane of points, oriented like `like`; false when the points do not span a plane.
bool least_squares(const std::vector<Point3>& all, const std::vector<std::uint32_t>& which,
                   const Point3& like, FlatPlane& out);

[[nodiscard]] double largest_distance(const std::vector<Point3>& all,
                                      const std::vector<std::uint32_t>& which,
                                      const FlatPlane& plane);

/// n.x - d with n, d given as head and tail, to about 2^-100: two-fold products and sums.
[[nodiscard]] double fine_distance(const Point3& n, const Point3& tail, const Point3& x, double d,
                                   double d_tail);

/// One Newton step of the least-squares fit with exact residuals: fills the tails.
void refine(const std::vector<Point3>& all, FittedPlane& plane);

}  // namespace haptic::tools
