// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/surface/triangle_gap.hpp"

#include <algorithm>
#include <cmath>

#include "tools/graph_compiler/mesh/shell_interior.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

/// Sine below which two directions are parallel.
constexpr double kParallelSides = 1e-9;

/// Distance of two segments.
double segment_distance_m(const Point3& p, const Point3& q, const Point3& a, const Point3& b) {
  const Point3 u = vec::sub(q, p), v = vec::sub(b, a), w = vec::sub(p, a);
  const double uu = vec::dot(u, u), uv = vec::dot(u, v), vv = vec::dot(v, v);
  const double uw = vec::dot(u, w), vw = vec::dot(v, w);
  const double det = uu * vv - uv * uv;
  // The nearest points of the lines, where they have one; then each held within its segment.
  double s = det > 1e-18 * uu * vv ? std::clamp((uv * vw - vv * uw) / det, 0.0, 1.0) : 0.0;
  double t = (uv * s + vw) / vv;
  if (t < 0.0 || t > 1.0) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((uv * t - uw) / uu, 0.0, 1.0);
  }
  return vec::norm(vec::add(w, vec::sub(vec::scaled(u, s), vec::scaled(v, t))));
}

struct Range {
  double low = HUGE_VAL, high = -HUGE_VAL;
};

Range range_of(const TriangleCorners& t, const Point3& axis) {
  Range range;
  for (const Point3& x : t) {
    const double at = vec::dot(axis, x);
    range.low = std::min(range.low, at);
    range.high = std::max(range.high, at);
  }
  return range;
}

}  // namespace

double triangle_distance_m(const TriangleCorners& s, const TriangleCorners& t) {
  if (triangles_cross(s, t)) return 0.0;
  double least = HUGE_VAL;
  for (std::size_t k = 0; k < 3; ++k) {
    least = std::min({least, triangle_distance(s[k], t), triangle_distance(t[k], s)});
    for (std::size_t l = 0; l < 3; ++l) {
      least = std::min(least, segment_distance_m(s[k], s[(k + 1) % 3], t[l], t[(l + 1) % 3]));
    }
  }
  return least;
}

double triangle_overlap_m(const TriangleCorners& s, const TriangleCorners& t) {
  double least = HUGE_VAL;
  const auto look = [&](const Point3& direction, double length) {
    if (!(vec::norm(direction) > kParallelSides * length)) return;
    const Point3 axis = vec::unit(direction);
    const Range a = range_of(s, axis), b = range_of(t, axis);
    least = std::min({least, a.high - b.low, b.high - a.low});
  };
  const Point3 n_s = vec::unit(exact_twice_area(s.data(), 3));
  const Point3 n_t = vec::unit(exact_twice_area(t.data(), 3));
  look(n_s, 1.0);
  look(n_t, 1.0);
  for (std::size_t k = 0; k < 3; ++k) {
    const Point3 u = vec::sub(s[(k + 1) % 3], s[k]), v = vec::sub(t[(k + 1) % 3], t[k]);
    look(vec::cross(n_s, u), vec::norm(u));
    look(vec::cross(n_t, v), vec::norm(v));
    for (std::size_t l = 0; l < 3; ++l) {
      const Point3 other = vec::sub(t[(l + 1) % 3], t[l]);
      look(vec::cross(u, other), vec::norm(u) * vec::norm(other));
    }
  }
  return least;
}

}  // namespace haptic::tools
