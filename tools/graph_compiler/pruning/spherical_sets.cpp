// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/pruning/spherical_sets.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

/// Directions this close [rad] are one, and a point this far beyond a side is still on it.
constexpr double kSame_rad = 1.0e-9;
constexpr double kFar_rad = std::numeric_limits<double>::infinity();

bool inside(const Direction& p, const std::vector<Direction>& sides) {
  return std::all_of(sides.begin(), sides.end(),
                     [&](const Direction& d) { return vec::dot(p, d) <= kSame_rad; });
}

bool near_any(const Direction& p, const std::vector<Direction>& list) {
  return std::any_of(list.begin(), list.end(),
                     [&](const Direction& q) { return vec::distance(p, q) <= kSame_rad; });
}

/// A point of the arc's great circle lies on the arc itself.
bool on_arc(const Direction& p, const SphericalArc& arc) {
  return vec::dot(vec::cross(arc.from, p), arc.pole) >= 0.0 &&
         vec::dot(vec::cross(p, arc.to), arc.pole) >= 0.0;
}

}  // namespace

SphericalArc spherical_arc(const Direction& from, const Direction& to) {
  return {from, to, vec::unit(vec::cross(from, to))};
}

SphericalPolygon spherical_polygon(const std::vector<Direction>& sides) {
  SphericalPolygon polygon;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    for (std::size_t k = i + 1; k < sides.size(); ++k) {
      const Direction ray = vec::cross(sides[i], sides[k]);
      if (vec::norm(ray) <= kSame_rad) continue;
      for (const double sign : {1.0, -1.0}) {
        const Direction corner = vec::unit(vec::scaled(ray, sign));
        if (inside(corner, sides) && !near_any(corner, polygon.corners)) {
          polygon.corners.push_back(corner);
        }
      }
    }
  }
  for (const Direction& d : sides) {
    const auto on_side = std::count_if(
        polygon.corners.begin(), polygon.corners.end(),
        [&](const Direction& corner) { return std::abs(vec::dot(corner, d)) <= kSame_rad; });
    if (on_side >= 2 && !near_any(d, polygon.sides)) polygon.sides.push_back(d);
  }
  return polygon;
}

double angle_between(const Direction& a, const Direction& b) {
  return std::atan2(vec::norm(vec::cross(a, b)), vec::dot(a, b));
}

double angle_to(const Direction& p, const SphericalArc& arc) {
  const double height = vec::dot(p, arc.pole);
  const Direction foot = vec::sub(p, vec::scaled(arc.pole, height));
  // Where p is the pole itself, all points of the arc are as far.
  if (on_arc(foot, arc)) return std::asin(std::min(1.0, std::abs(height)));
  return std::min(angle_between(p, arc.from), angle_between(p, arc.to));
}

double angle_to(const Direction& p, const SphericalPolygon& polygon) {
  bool within = true;
  double least = kFar_rad;
  for (const Direction& d : polygon.sides) {
    const double beyond = vec::dot(p, d);
    if (beyond <= 0.0) continue;
    within = false;
    const Direction foot = vec::sub(p, vec::scaled(d, beyond));
    const double length = vec::norm(foot);
    if (length > 0.0 && inside(vec::scaled(foot, 1.0 / length), polygon.sides)) {
      least = std::min(least, std::asin(std::min(1.0, beyond)));
    }
  }
  if (within) return 0.0;
  for (const Direction& corner : polygon.corners) least = std::min(least, angle_between(p, corner));
  return least;
}

double angle_to(const SphericalArc& a, const SphericalArc& b) {
  const Direction line = vec::cross(a.pole, b.pole);
  const double length = vec::norm(line);
  if (length > 0.0) {
    const Direction x = vec::scaled(line, 1.0 / length), y = vec::scaled(line, -1.0 / length);
    if ((on_arc(x, a) && on_arc(x, b)) || (on_arc(y, a) && on_arc(y, b))) return 0.0;
  }
  return std::min({angle_to(a.from, b), angle_to(a.to, b), angle_to(b.from, a), angle_to(b.to, a)});
}

}  // namespace haptic::tools
