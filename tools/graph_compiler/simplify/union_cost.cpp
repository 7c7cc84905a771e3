// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/simplify/union_cost.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "tools/graph_compiler/mesh/shell_interior.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

constexpr double kRefused = std::numeric_limits<double>::infinity();
constexpr double kLargestTurnCosine = 0.25881904510252074;  // cos 75 degrees
constexpr double kLargestMove = 6.0;  // of the distance: along the surface, at acute corners
constexpr double kLikeSize = 0.2;     // areas: from here on the two take a new plane

std::vector<vec::Box> triangle_boxes(const std::vector<FaceTriangle>& triangles) {
  std::vector<vec::Box> boxes;
  for (const FaceTriangle& t : triangles) {
    vec::Box box;
    for (const Point3& p : t) box.include(p);
    boxes.push_back(box);
  }
  return boxes;
}

bool turned_too_far(const Region& region, const HessePlane& plane) {
  return vec::dot(region.area, plane.normal) < kLargestTurnCosine * vec::norm(region.area);
}

}  // namespace

HessePlane plane_of_both(const Surface& surface, const Region& a, const Region& b) {
  std::vector<std::uint32_t> all;
  std::set_union(a.vertices.begin(), a.vertices.end(), b.vertices.begin(), b.vertices.end(),
                 std::back_inserter(all));
  return middle_plane(surface.vertices, all, vec::add(a.area, b.area));
}

UnionJudge::UnionJudge(const Surface& surface, SurfaceRegions& map,
                       const std::vector<HessePlane>& planes, const std::vector<Point3>& position,
                       double distance_m, const std::vector<double>& allowance_m)
    : s_(surface),
      map_(map),
      planes_(planes),
      position_(position),
      distance_(distance_m),
      allowance_(allowance_m),
      triangles_(triangles_of(surface)),
      tree_(triangle_boxes(triangles_)),
      trial_stamp_(surface.vertices.size(), 0),
      trial_position_(surface.vertices) {}

double UnionJudge::distance_from_surface(const Point3& p) {
  vec::Box box;
  box.include(p);
  tree_.find(box.grown(distance_), found_);
  double least = kRefused;
  for (const std::uint32_t k : found_) least = std::min(least, triangle_distance(p, triangles_[k]));
  return least;
}

/// The planes at a vertex with outward normals, as they would be after the union.
std::size_t UnionJudge::plane_at(std::uint32_t face, std::uint32_t larger, std::uint32_t smaller,
                                 const HessePlane& plane, std::vector<HessePlane>& own) {
  const std::uint32_t r = map_.region_at(face);
  // Other regions may lie on the plane of the larger one too.
  const bool joined = r == larger || r == smaller || map_.region(r).plane == joined_plane_;
  const std::uint32_t key = joined ? kNone : map_.region(r).plane;
  const auto known = std::find(around_.begin(), around_.end(), key);
  if (known != around_.end()) return static_cast<std::size_t>(known - around_.begin());
  HessePlane outward = joined ? plane : planes_[key];
  if (!joined && vec::dot(outward.normal, map_.region(r).area) < 0.0) {
    outward = {vec::scaled(outward.normal, -1.0), -outward.offset};
  }
  around_.push_back(key);
  own.push_back(outward);
  return own.size() - 1;
}

/// Distance of the old place from the new faces around it: from a plane, where the foot lies in the
/// part of the plane that its edges with the other planes leave.
double UnionJudge::distance_to_faces(std::uint32_t v, std::uint32_t larger, std::uint32_t smaller,
                                     const HessePlane& plane, std::vector<HessePlane>& own) {
  const Point3& before = s_.vertices[v];
  const auto height = [&](std::size_t p) {
    return vec::dot(own[p].normal, before) - own[p].offset;
  };
  std::vector<bool> covers(own.size(), true);
  for (const std::uint32_t f : map_.faces_at(v)) {
    const std::vector<std::uint32_t>& loop = s_.faces[f].vertices;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      if (loop[k] != v) continue;
      const std::size_t left = plane_at(f, larger, smaller, plane, own);
      const std::size_t right = plane_at(map_.across(f, k), larger, smaller, plane, own);
      if (left == right) continue;
      const Point3 along = vec::sub(s_.vertices[loop[(k + 1) % loop.size()]], before);
      const Point3 line = vec::cross(own[left].normal, own[right].normal);
      const double side = vec::dot(line, along) < 0.0 ? -1.0 : 1.0;  // -1: a reflex edge
      const double rounding = 1.0e-12 * s_.diagonal_m;
      if (side * height(right) > rounding) covers[left] = false;
      if (side * height(left) > rounding) covers[right] = false;
    }
  }
  double least = kRefused;
  for (std::size_t p = 0; p < own.size(); ++p) {
    if (covers[p]) least = std::min(least, std::abs(height(p)));
  }
  return least;
}

double UnionJudge::vertex_cost(std::uint32_t v, std::uint32_t larger, std::uint32_t smaller,
                               const HessePlane& plane, bool new_plane, double known) {
  around_.clear();
  joined_plane_ = new_plane ? kNone : map_.region(larger).plane;
  std::vector<HessePlane> own;
  for (const std::uint32_t f : map_.faces_at(v)) plane_at(f, larger, smaller, plane, own);
  const Point3& before = s_.vertices[v];
  const PlaneCorner corner = nearest_corner(own, before);
  if (!corner.found || corner.residual > 0.5 * distance_) return kRefused;
  const double move = vec::distance(corner.point, before);
  if (move > kLargestMove * distance_) return kRefused;
  const double inward = std::min(move, distance_to_faces(v, larger, smaller, plane, own));
  const double cost = std::max(inward, 2.0 * corner.residual);
  if (cost > distance_) return kRefused;
  trial_position_[v] = corner.point;
  trial_stamp_[v] = trial_;
  // The old place is on the surface: a short move needs no search.
  if (move <= std::max(cost, known)) return std::max(cost, std::min(move, known));
  return std::max(cost, distance_from_surface(corner.point));
}

/// No border between two corners turns over, or its faces would cross themselves.
bool UnionJudge::edges_stay(const std::vector<std::uint32_t>& affected) {
  for (const std::uint32_t v : affected) {
    if (!map_.is_corner(v)) continue;
    map_.border_ends(v, ends_);
    for (const std::uint32_t w : ends_) {
      map_.border_chain(v, w, chain_);
      const std::uint32_t end = chain_.back();
      if (end == v) return false;
      const Point3 after = vec::sub(position(end), position(v));
      if (vec::norm(after) <= kSamePlace * s_.diagonal_m) continue;
      if (!(vec::dot(vec::sub(s_.vertices[end], s_.vertices[v]), after) > 0.0)) return false;
    }
  }
  return true;
}

double UnionJudge::cost_of(std::uint32_t larger, std::uint32_t smaller, const HessePlane& plane,
                           bool new_plane) {
  double cost = 0.0;
  ++trial_;
  const auto look_at = [&](const std::vector<std::uint32_t>& vertices) {
    for (const std::uint32_t v : vertices) {
      const double here = vertex_cost(v, larger, smaller, plane, new_plane, cost);
      cost = here <= allowance_[v] ? std::max(cost, here) : kRefused;
      if (cost > distance_) return;
    }
  };
  look_at(map_.region(smaller).vertices);
  if (new_plane) look_at(map_.region(larger).vertices);
  if (!(cost <= distance_)) return kRefused;
  map_.pretend(smaller, larger);
  const bool stays = edges_stay(map_.region(smaller).vertices) &&
                     (!new_plane || edges_stay(map_.region(larger).vertices));
  map_.pretend_nothing();
  return stays ? cost : kRefused;
}

Union UnionJudge::judged(std::uint32_t a, std::uint32_t b) {
  const bool swap = std::make_pair(map_.region(b).size, a) > std::make_pair(map_.region(a).size, b);
  Union best;
  best.larger = swap ? b : a;
  best.smaller = swap ? a : b;
  const Region& larger = map_.region(best.larger);
  const Region& smaller = map_.region(best.smaller);
  if (s_.faces[larger.faces[0]].shell != s_.faces[smaller.faces[0]].shell) return best;
  HessePlane plane = planes_[larger.plane];
  // Regions lie on either side of the planes of the table.
  if (vec::dot(plane.normal, larger.area) < 0.0) {
    plane.normal = vec::scaled(plane.normal, -1.0);
    plane.offset = -plane.offset;
  }
  if (!turned_too_far(smaller, plane))
    best.cost_m = cost_of(best.larger, best.smaller, plane, false);
  if (smaller.size > kLikeSize * larger.size) {
    const HessePlane both = plane_of_both(s_, larger, smaller);
    if (!turned_too_far(smaller, both) && !turned_too_far(larger, both)) {
      const double cost = cost_of(best.larger, best.smaller, both, true);
      if (cost < best.cost_m) best.cost_m = cost, best.new_plane = true;
    }
  }
  return best;
}

}  // namespace haptic::tools
