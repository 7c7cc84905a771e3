// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/shell_interior.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace haptic::tools {
namespace {

/// Fixed directions, off the axes and off the diagonals of anything likely.
constexpr std::array<Point3, 3> kRays = {{{0.8660919, 0.3701547, 0.3359761},
                                          {-0.2741739, 0.8917213, -0.3600913},
                                          {0.4109713, -0.5199139, 0.7488157}}};

std::vector<vec::Box> boxes_of(const std::vector<ShellInterior::Triangle>& triangles) {
  std::vector<vec::Box> boxes(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (const Point3& p : triangles[i]) {
      boxes[i].include(p);
    }
  }
  return boxes;
}

double segment_distance(const Point3& p, const Point3& a, const Point3& b) {
  const Point3 along = vec::sub(b, a);
  const double square = vec::dot(along, along);
  const double t =
      square > 0.0 ? std::clamp(vec::dot(vec::sub(p, a), along) / square, 0.0, 1.0) : 0.0;
  return vec::distance(p, vec::add(a, vec::scaled(along, t)));
}

/// Positive where the triangle is seen from behind. Van Oosterom and Strackee: tan(omega / 2).
double solid_angle(const Point3& point, const ShellInterior::Triangle& triangle) {
  const Point3 a = vec::sub(triangle[0], point);
  const Point3 b = vec::sub(triangle[1], point);
  const Point3 c = vec::sub(triangle[2], point);
  const double la = vec::norm(a), lb = vec::norm(b), lc = vec::norm(c);
  return 2.0 *
         std::atan2(vec::dot(a, vec::cross(b, c)),
                    la * lb * lc + vec::dot(a, b) * lc + vec::dot(b, c) * la + vec::dot(c, a) * lb);
}

/// In full turns.
double solid_angles(const Point3& point, const std::vector<ShellInterior::Triangle>& triangles) {
  double total = 0.0;
  for (const ShellInterior::Triangle& t : triangles) total += solid_angle(point, t);
  return total / (4.0 * std::numbers::pi);
}

std::vector<ShellInterior::Triangle> joined(std::vector<ShellInterior::Triangle> a,
                                            const std::vector<ShellInterior::Triangle>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace

double triangle_distance(const Point3& point, const ShellInterior::Triangle& t) {
  const Point3 normal = vec::unit(vec::cross(vec::sub(t[1], t[0]), vec::sub(t[2], t[0])));
  bool above = vec::norm(normal) > 0.0;
  double nearest = HUGE_VAL;
  for (std::size_t i = 0; i < 3; ++i) {
    const Point3& a = t[i];
    const Point3& b = t[(i + 1) % 3];
    above = above && vec::dot(vec::cross(normal, vec::sub(b, a)), vec::sub(point, a)) >= 0.0;
    nearest = std::min(nearest, segment_distance(point, a, b));
  }
  return above ? std::abs(vec::dot(normal, vec::sub(point, t[0]))) : nearest;
}

ShellInterior::ShellInterior(std::vector<Triangle> triangles, double tolerance_m)
    : triangles_(std::move(triangles)), tolerance_m_(tolerance_m), tree_(boxes_of(triangles_)) {}

PointPlace ShellInterior::place_of(const Point3& point) const {
  for (const Point3& direction : kRays) {
    int winding = 0;
    const Ray ray = cast_ray(point, direction, winding);
    if (ray == Ray::kStartsOnSurface) return PointPlace::kOnSurface;
    if (ray == Ray::kCrosses) return winding != 0 ? PointPlace::kInside : PointPlace::kOutside;
  }
  return by_solid_angle(point);
}

std::optional<int> ShellInterior::winding_of(const Point3& point) const {
  for (const Point3& direction : kRays) {
    int winding = 0;
    const Ray ray = cast_ray(point, direction, winding);
    if (ray == Ray::kStartsOnSurface) return std::nullopt;
    if (ray == Ray::kCrosses) return winding;
  }
  return std::nullopt;
}

/// Undecided: the ray comes too close to an edge.
ShellInterior::Ray ShellInterior::cast_ray(const Point3& point, const Point3& direction,
                                           int& winding) const {
  std::vector<std::uint32_t> candidates;
  tree_.find_ray(point, direction, 2.0 * tolerance_m_, candidates);
  winding = 0;
  for (const std::uint32_t index : candidates) {
    const Triangle& triangle = triangles_[index];
    const Point3 a = vec::sub(triangle[0], point);
    const Point3 b = vec::sub(triangle[1], point);
    const Point3 c = vec::sub(triangle[2], point);
    // Side products of the line with the three edge lines; divided by the length of the projected
    // edge they are distances of the line from the edges, positive inside if the triangle is seen
    // from behind.
    const std::array<std::pair<const Point3*, const Point3*>, 3> edges = {
        {{&a, &b}, {&b, &c}, {&c, &a}}};
    double sum = 0.0;
    std::array<double, 3> side{};
    std::array<double, 3> length{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [p, q] = edges[i];
      side[i] = vec::dot(direction, vec::cross(*p, *q));
      length[i] = vec::norm(vec::cross(direction, vec::sub(*q, *p)));
      sum += side[i];
    }
    const double sign = sum < 0.0 ? -1.0 : 1.0;
    bool missed = false;
    bool close = false;
    for (std::size_t i = 0; i < 3; ++i) {
      missed = missed || sign * side[i] < -tolerance_m_ * length[i];
      close = close || sign * side[i] <= tolerance_m_ * length[i];
    }
    if (missed) {
      continue;
    }
    if (close) {
      return Ray::kUndecided;
    }
    const Point3 normal = vec::unit(vec::cross(vec::sub(b, a), vec::sub(c, a)));
    const double height = vec::dot(a, normal);
    if (std::abs(height) <= tolerance_m_) {
      return Ray::kStartsOnSurface;
    }
    if ((height > 0.0) == (vec::dot(direction, normal) > 0.0)) {
      winding += sum < 0.0 ? -1 : 1;
    }
  }
  return Ray::kCrosses;
}

PointPlace ShellInterior::by_solid_angle(const Point3& point) const {
  double total = 0.0;
  for (const Triangle& triangle : triangles_) {
    if (triangle_distance(point, triangle) <= tolerance_m_) {
      return PointPlace::kOnSurface;
    }
    total += solid_angle(point, triangle);
  }
  return std::abs(total) > 2.0 * std::numbers::pi ? PointPlace::kInside : PointPlace::kOutside;
}

OpenShellInterior::OpenShellInterior(std::vector<Triangle> facets, std::vector<Triangle> rim,
                                     double tolerance_m)
    : facets_(std::move(facets)),
      rim_(std::move(rim)),
      whole_(joined(facets_, rim_), tolerance_m) {}

double OpenShellInterior::winding_of(const Point3& point) const {
  if (const std::optional<int> whole = whole_.winding_of(point)) {
    return *whole - solid_angles(point, rim_);
  }
  return solid_angles(point, facets_);
}

}  // namespace haptic::tools
