// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Arithmetic on Point3 for the cleaning of meshes. No fused operations: the same bits with every
/// compiler.

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools::vec {

inline Point3 add(const Point3& a, const Point3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Point3 sub(const Point3& a, const Point3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Point3 scaled(const Point3& a, double factor) {
  return {a[0] * factor, a[1] * factor, a[2] * factor};
}
inline double dot(const Point3& a, const Point3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Point3 cross(const Point3& a, const Point3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double norm(const Point3& a) { return std::sqrt(dot(a, a)); }
inline double distance(const Point3& a, const Point3& b) { return norm(sub(a, b)); }
/// Unit vector, or zero for a zero vector.
inline Point3 unit(const Point3& a) {
  const double length = norm(a);
  return length > 0.0 ? scaled(a, 1.0 / length) : Point3{0, 0, 0};
}

/// Axis-aligned box; empty until a point is included.
struct Box {
  Point3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL};
  Point3 high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  void include(const Point3& p) {
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  }
  Box grown(double margin) const {
    Box box = *this;
    for (std::size_t i = 0; i < 3; ++i) {
      box.low[i] -= margin;
      box.high[i] += margin;
    }
    return box;
  }
  bool meets(const Box& other) const {
    for (std::size_t i = 0; i < 3; ++i) {
      if (low[i] > other.high[i] || high[i] < other.low[i]) {
        return false;
      }
    }
    return true;
  }
  bool holds(const Box& other) const {
    for (std::size_t i = 0; i < 3; ++i) {
      if (other.low[i] < low[i] || other.high[i] > high[i]) {
        return false;
      }
    }
    return true;
  }
  double diagonal() const { return distance(low, high); }
};

/// Twice the area vector of a closed polygon, by a fan from its first corner: exact under
/// translation of the polygon far from the origin, also for concave and not quite flat polygons.
inline Point3 twice_area(const std::vector<Point3>& points, std::span<const std::uint32_t> loop) {
  Point3 sum{0, 0, 0};
  const Point3& origin = points[loop[0]];
  for (std::size_t i = 1; i + 1 < loop.size(); ++i) {
    sum = add(sum, cross(sub(points[loop[i]], origin), sub(points[loop[i + 1]], origin)));
  }
  return sum;
}

/// Six times the signed volume between `apex` and a polygon, as a fan around its middle: bent
/// polygons have a volume that does not depend on where the loop starts, and that changes its sign
/// with the direction.
inline double six_volumes(const std::vector<Point3>& points, std::span<const std::uint32_t> loop,
                          const Point3& apex) {
  Point3 middle{0, 0, 0};
  Point3 area{0, 0, 0};
  Point3 before = sub(points[loop.back()], apex);
  for (const std::uint32_t v : loop) {
    const Point3 p = sub(points[v], apex);
    middle = add(middle, p);
    area = add(area, cross(before, p));
    before = p;
  }
  return dot(middle, area) / static_cast<double>(loop.size());
}

/// Longest distance between two corners, to within a factor of sqrt(3) below.
inline double extent(const std::vector<Point3>& points, std::span<const std::uint32_t> loop) {
  double longest = 0.0;
  for (const std::uint32_t v : loop) {
    longest = std::max(longest, distance(points[loop[0]], points[v]));
  }
  return longest;
}

}  // namespace haptic::tools::vec
