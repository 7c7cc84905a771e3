// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/simplify/plane_corner.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/polyhedron/symmetric_axes.hpp"

namespace haptic::tools {
namespace {

constexpr double kLeastSineSquare = 1.0e-5;         // two planes: about a fifth of a degree
constexpr double kLeastCornerDeterminant = 1.0e-3;  // three planes; below, least squares decides
constexpr double kOpenDirection = 1.0e-4;           // of the largest eigenvalue of the sum of n n^T

double largest_residual(const std::vector<HessePlane>& planes, const Point3& x) {
  double largest = 0.0;
  for (const HessePlane& p : planes) {
    largest = std::max(largest, std::abs(vec::dot(p.normal, x) - p.offset));
  }
  return largest;
}

Point3 on_line(const HessePlane& a, const HessePlane& b, const Point3& from) {
  const double ab = vec::dot(a.normal, b.normal);
  const double ra = a.offset - vec::dot(a.normal, from);
  const double rb = b.offset - vec::dot(b.normal, from);
  const double det = 1.0 - ab * ab;
  return vec::add(from, vec::add(vec::scaled(a.normal, (ra - ab * rb) / det),
                                 vec::scaled(b.normal, (rb - ab * ra) / det)));
}

/// Moves along the directions that the planes fix well.
Point3 least_squares_point(const std::vector<HessePlane>& planes, const Point3& from) {
  std::array<std::array<double, 3>, 3> m{}, axes{};
  Point3 pull{0, 0, 0};
  for (const HessePlane& p : planes) {
    const double r = p.offset - vec::dot(p.normal, from);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) m[i][j] += p.normal[i] * p.normal[j];
      pull[i] += r * p.normal[i];
    }
  }
  diagonalise(m, axes);
  const double largest = std::max({m[0][0], m[1][1], m[2][2]});
  Point3 x = from;
  for (std::size_t k = 0; k < 3; ++k) {
    if (m[k][k] < kOpenDirection * largest) continue;
    const Point3 axis{axes[0][k], axes[1][k], axes[2][k]};
    x = vec::add(x, vec::scaled(axis, vec::dot(axis, pull) / m[k][k]));
  }
  return x;
}

}  // namespace

PlaneCorner nearest_corner(const std::vector<HessePlane>& planes, const Point3& from) {
  PlaneCorner out;
  if (planes.empty()) return out;
  const HessePlane& a = planes[0];
  if (planes.size() == 1) {
    const double r = a.offset - vec::dot(a.normal, from);
    return {true, vec::add(from, vec::scaled(a.normal, r)), 0.0};
  }
  if (planes.size() == 2) {
    const Point3 line = vec::cross(a.normal, planes[1].normal);
    if (vec::dot(line, line) < kLeastSineSquare) return out;
    out.point = on_line(a, planes[1], from);
  } else if (planes.size() == 3) {
    const HessePlane& b = planes[1];
    const HessePlane& c = planes[2];
    const Point3 bc = vec::cross(b.normal, c.normal);
    const double det = vec::dot(a.normal, bc);
    if (std::abs(det) > kLeastCornerDeterminant) {
      const Point3 ca = vec::cross(c.normal, a.normal), ab = vec::cross(a.normal, b.normal);
      const double ra = a.offset - vec::dot(a.normal, from);
      const double rb = b.offset - vec::dot(b.normal, from);
      const double rc = c.offset - vec::dot(c.normal, from);
      const Point3 move =
          vec::add(vec::scaled(bc, ra), vec::add(vec::scaled(ca, rb), vec::scaled(ab, rc)));
      out.point = vec::add(from, vec::scaled(move, 1.0 / det));
    } else {
      out.point = least_squares_point(planes, from);
    }
  } else {
    out.point = least_squares_point(planes, from);
  }
  out.found = true;
  out.residual = largest_residual(planes, out.point);
  return out;
}

HessePlane middle_plane(const std::vector<Point3>& all, const std::vector<std::uint32_t>& which,
                        const Point3& like) {
  Point3 mean{0, 0, 0};
  for (const std::uint32_t v : which) mean = vec::add(mean, all[v]);
  mean = vec::scaled(mean, 1.0 / static_cast<double>(which.size()));
  std::array<std::array<double, 3>, 3> moments{}, axes{};
  for (const std::uint32_t v : which) {
    const Point3 r = vec::sub(all[v], mean);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) moments[i][j] += r[i] * r[j];
    }
  }
  diagonalise(moments, axes);
  std::size_t least = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    if (moments[k][k] < moments[least][least]) least = k;
  }
  HessePlane plane;
  plane.normal = vec::unit({axes[0][least], axes[1][least], axes[2][least]});
  if (vec::dot(plane.normal, like) < 0.0) plane.normal = vec::scaled(plane.normal, -1.0);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const std::uint32_t v : which) {
    const double d = vec::dot(plane.normal, all[v]);
    low = std::min(low, d);
    high = std::max(high, d);
  }
  plane.offset = 0.5 * (low + high);
  return plane;
}

}  // namespace haptic::tools
