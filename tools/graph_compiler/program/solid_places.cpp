// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/solid_places.hpp"

#include <algorithm>
#include <cmath>

namespace haptic::tools {
namespace {

/// Sine of two edges below which they are parallel, and their cross product says nothing.
constexpr double kParallel = 1e-9;

Point3 point_of(const Real* x, const double* about) {
  return {static_cast<double>(x[0]) + about[0], static_cast<double>(x[1]) + about[1],
          static_cast<double>(x[2]) + about[2]};
}

double least_along(const std::vector<Point3>& points, const Point3& n) {
  double least = HUGE_VAL;
  for (const Point3& x : points) least = std::min(least, vec::dot(n, x));
  return least;
}

double most_along(const std::vector<Point3>& points, const Point3& n) {
  return -least_along(points, vec::scaled(n, -1.0));
}

vec::Box moved(const vec::Box& box, const Point3& by) {
  return {vec::add(box.low, by), vec::add(box.high, by)};
}

}  // namespace

SolidPlaces::SolidPlaces(const SceneView& scene, double touching_m) : touching_m_(touching_m) {
  for (std::uint32_t k = 0; k < scene.pieces().size(); ++k) {
    const PieceView view = scene.piece(k);
    const double* const about = scene.bodies()[view.record->body].reference_m;
    Piece piece;
    for (std::uint32_t v = 0; v < view.vertex_count; ++v) {
      piece.corners.push_back(point_of(view.vertices + 3 * std::size_t{v}, about));
      piece.box.include(piece.corners.back());
    }
    for (std::uint32_t f = 0; f < view.face_count; ++f) {
      const Vec3 n = view.face_normal(f);
      piece.normals.push_back(
          {static_cast<double>(n.x()), static_cast<double>(n.y()), static_cast<double>(n.z())});
      piece.offsets_m.push_back(most_along(piece.corners, piece.normals.back()));
    }
    for (std::uint32_t e = 0; e < view.edge_count; ++e) {
      const EdgeRecord& edge = view.edges[e];
      piece.edges.push_back(
          vec::unit(vec::sub(piece.corners[edge.vertex[1]], piece.corners[edge.vertex[0]])));
    }
    (k < scene.bodies()[0].piece_count ? moving_ : fixed_).push_back(std::move(piece));
  }
}

double SolidPlaces::face_gap_m(const Piece& a, const Piece& b, const Point3& p, double enough_m) {
  double most = -HUGE_VAL;
  for (std::size_t f = 0; f < a.normals.size() && most < enough_m; ++f) {
    most = std::max(
        most, least_along(b.corners, a.normals[f]) - a.offsets_m[f] - vec::dot(a.normals[f], p));
  }
  for (std::size_t f = 0; f < b.normals.size() && most < enough_m; ++f) {
    most = std::max(
        most, least_along(a.corners, b.normals[f]) - b.offsets_m[f] + vec::dot(b.normals[f], p));
  }
  return most;
}

double SolidPlaces::edge_gap_m(const Piece& a, const Piece& b, const Point3& p, double enough_m) {
  double most = -HUGE_VAL;
  for (const Point3& of_a : a.edges) {
    for (const Point3& of_b : b.edges) {
      Point3 n = vec::cross(of_a, of_b);
      if (vec::norm(n) < kParallel) continue;
      n = vec::unit(n);
      const double shift = vec::dot(n, p);
      most = std::max({most, least_along(a.corners, n) + shift - most_along(b.corners, n),
                       least_along(b.corners, n) - most_along(a.corners, n) - shift});
      if (most >= enough_m) return most;
    }
  }
  return most;
}

double SolidPlaces::ball_m(const Piece& a, const Piece& b, const Point3& p) {
  const auto largest = [](const Piece& inside, const Piece& around, const Point3& by) {
    const auto depth = [&](const Point3& x) {
      double least = HUGE_VAL;
      for (std::size_t f = 0; f < around.normals.size(); ++f)
        least = std::min(least, around.offsets_m[f] - vec::dot(around.normals[f], vec::add(x, by)));
      return least;
    };
    Point3 middle{0, 0, 0};
    double most = -HUGE_VAL;
    for (const Point3& x : inside.corners) {
      most = std::max(most, depth(x));
      middle = vec::add(middle, vec::scaled(x, 1.0 / static_cast<double>(inside.corners.size())));
    }
    return std::max(most, depth(middle));
  };
  return std::max(largest(a, b, p), largest(b, a, vec::scaled(p, -1.0)));
}

bool SolidPlaces::overlaps(const Point3& p) const {
  for (const Piece& a : moving_) {
    const vec::Box box = moved(a.box, p);
    for (const Piece& b : fixed_) {
      if (!box.meets(b.box) || face_gap_m(a, b, p, -touching_m_) >= -touching_m_) continue;
      if (ball_m(a, b, p) > touching_m_) return true;
      if (a.edges.size() * b.edges.size() > kMostEdgeDirections ||
          edge_gap_m(a, b, p, -touching_m_) < -touching_m_) {
        return true;
      }
    }
  }
  return false;
}

double SolidPlaces::depth_m(const Point3& p) const {
  double depth_m = 0.0;
  for (const Piece& a : moving_) {
    const vec::Box box = moved(a.box, p);
    for (const Piece& b : fixed_) {
      if (!box.meets(b.box)) continue;
      // Pairs that overlap less than the deepest so far are not looked at further.
      const double enough_m = -std::max(depth_m, touching_m_);
      double gap = face_gap_m(a, b, p, enough_m);
      if (gap < enough_m && a.edges.size() * b.edges.size() <= kMostEdgeDirections)
        gap = std::max(gap, edge_gap_m(a, b, p, enough_m));
      if (gap < enough_m) depth_m = -gap;
    }
  }
  return depth_m;
}

}  // namespace haptic::tools
