// SPDX-License-Identifier: Apache-2.0
#include "tests/support/manifold_oracle.hpp"

#include <algorithm>
#include <cmath>

namespace haptic::test {
namespace {

ExactPoint minus(const ExactPoint& p, const ExactPoint& q) { return {p.x - q.x, p.y - q.y}; }
Exact dot_of(const ExactPoint& p, const ExactPoint& q) { return p.x * q.x + p.y * q.y; }
Exact cross_of(const ExactPoint& p, const ExactPoint& q) { return p.x * q.y - p.y * q.x; }

Exact distance_from_segment(const ExactPoint& a, const ExactPoint& b, const ExactPoint& p) {
  const ExactPoint way = minus(b, a);
  const Exact length2 = dot_of(way, way);
  const Exact share =
      length2 > 0 ? std::clamp<Exact>(dot_of(minus(p, a), way) / length2, 0, 1) : Exact{0};
  return std::hypot(p.x - a.x - share * way.x, p.y - a.y - share * way.y);
}

}  // namespace

Exact distance_from(const ExactPolygon& set, const ExactPoint& p) {
  bool inside = set.size() > 2;
  Exact distance = std::numeric_limits<Exact>::max();
  for (std::size_t k = 0; k < set.size(); ++k) {
    const ExactPoint& a = set[k];
    const ExactPoint& b = set[(k + 1) % set.size()];
    distance = std::min(distance, distance_from_segment(a, b, p));
    inside = inside && cross_of(minus(b, a), minus(p, a)) >= 0;
  }
  return inside ? 0 : distance;
}

Exact area_of(const ExactPolygon& polygon) {
  Exact twice = 0;
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
    twice += cross_of(minus(polygon[k], polygon[0]), minus(polygon[k + 1], polygon[0]));
  }
  return twice / 2;
}

ExactPolygon hull_of(ExactPolygon points) {
  std::sort(points.begin(), points.end(), [](const ExactPoint& l, const ExactPoint& r) {
    return l.x < r.x || (l.x == r.x && l.y < r.y);
  });
  if (points.size() < 3) return points;
  ExactPolygon hull;
  for (int chain = 0; chain < 2; ++chain) {
    const std::size_t base = hull.size();
    for (const ExactPoint& p : points) {
      while (hull.size() >= base + 2 &&
             cross_of(minus(hull.back(), hull[hull.size() - 2]), minus(p, hull.back())) <= 0) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

ExactPolygon intersection_of(const ExactPolygon& a, const ExactPolygon& b, Exact slack) {
  ExactPolygon corners;
  for (const ExactPoint& p : a)
    if (distance_from(b, p) <= slack) corners.push_back(p);
  for (const ExactPoint& p : b)
    if (distance_from(a, p) <= slack) corners.push_back(p);
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      const ExactPoint u = minus(a[(i + 1) % a.size()], a[i]);
      const ExactPoint v = minus(b[(j + 1) % b.size()], b[j]);
      const ExactPoint w = minus(b[j], a[i]);
      const Exact d = cross_of(u, v);
      if (std::abs(d) < 1e-9L * std::sqrt(dot_of(u, u) * dot_of(v, v)) || d == 0) continue;
      const Exact s = cross_of(w, v) / d, t = cross_of(w, u) / d;
      if (s < 0 || s > 1 || t < 0 || t > 1) continue;
      corners.push_back({a[i].x + s * u.x, a[i].y + s * u.y});
    }
  }
  return corners;
}

Exact ManifoldOracle::Feature::height_at(const ExactPoint& spot) const {
  if (corners.size() == 1) return heights[0];
  if (corners.size() == 2) {
    const ExactPoint way = minus(corners[1], corners[0]);
    return heights[0] +
           dot_of(minus(spot, corners[0]), way) / dot_of(way, way) * (heights[1] - heights[0]);
  }
  // The plane through the three corners that span most.
  std::size_t i = 1, j = 2;
  Exact most = 0;
  for (std::size_t k = 1; k < corners.size(); ++k) {
    for (std::size_t l = k + 1; l < corners.size(); ++l) {
      const Exact span = cross_of(minus(corners[k], corners[0]), minus(corners[l], corners[0]));
      if (std::abs(span) > std::abs(most)) {
        most = span;
        i = k;
        j = l;
      }
    }
  }
  const ExactPoint p = minus(spot, corners[0]);
  const Exact s = cross_of(p, minus(corners[j], corners[0])) / most;
  const Exact t = cross_of(minus(corners[i], corners[0]), p) / most;
  return heights[0] + s * (heights[i] - heights[0]) + t * (heights[j] - heights[0]);
}

ManifoldOracle::ManifoldOracle(const PairPose& pose, const PlaneId& id, const PlaneGap& gap,
                               double height_m)
    : r_(pose.r_wa.cast<long double>()),
      y_(pose.y_w.cast<long double>()),
      n_(gap.normal_w.cast<long double>().normalized()) {
  const Vector other = std::abs(n_[2]) < 0.8L ? Vector(0, 0, 1) : Vector(0, 1, 0);
  e1_ = n_.cross(other).normalized();
  e2_ = n_.cross(e1_);
  a_ = feature_of(pose.pair->a, true, gap.support.a,
                  id.type == ContactType::kA ? static_cast<int>(id.i) : -1,
                  static_cast<Exact>(height_m));
  b_ = feature_of(pose.pair->b, false, gap.support.b,
                  id.type == ContactType::kB ? static_cast<int>(id.j) : -1,
                  static_cast<Exact>(height_m));
}

ManifoldOracle::Vector ManifoldOracle::point_of(const PieceView& piece, bool is_a,
                                                std::uint32_t v) const {
  const Vector p = Vec3(piece.vertex(v)).cast<long double>();
  return is_a ? Vector(y_ + r_ * p) : p;
}

ExactPoint ManifoldOracle::spot(const Vec3& app_w) const {
  const Vector p = y_ + app_w.cast<long double>();
  return {e1_.dot(p), e2_.dot(p)};
}

Exact ManifoldOracle::height(const Vec3& app_w) const {
  return n_.dot(y_ + app_w.cast<long double>());
}

ManifoldOracle::Feature ManifoldOracle::feature_of(const PieceView& piece, bool is_a,
                                                   std::uint32_t support, int forced_face,
                                                   Exact height_m) {
  const Vector out = is_a ? Vector(-n_) : n_;
  Exact top = -std::numeric_limits<Exact>::max();
  for (std::uint32_t v = 0; v < piece.vertex_count; ++v) {
    top = std::max(top, out.dot(point_of(piece, is_a, v)));
  }
  const auto near_top = [&](std::uint32_t v) {
    const Exact drop = top - out.dot(point_of(piece, is_a, v));
    doubtful_ = doubtful_ || std::abs(drop - height_m) < 1e-6L * height_m;
    return drop <= height_m;
  };
  std::vector<std::uint32_t> chosen;
  if (forced_face >= 0) {
    for (const std::uint16_t v : piece.face_vertices(static_cast<std::uint32_t>(forced_face)))
      chosen.push_back(v);
  }
  Exact best = 0.9L;
  for (std::uint32_t f = 0; f < piece.face_count && forced_face < 0; ++f) {
    const auto loop = piece.face_vertices(f);
    if (std::find(loop.begin(), loop.end(), support) == loop.end()) continue;
    Vector normal = piece.face_normal(f).cast<long double>();
    if (is_a) normal = Vector(r_ * normal);
    const Exact c = normal.dot(out);
    const bool all = std::all_of(loop.begin(), loop.end(), near_top);
    if (all && std::abs(c - best) < 1e-6L) doubtful_ = true;
    if (!all || c <= best) continue;
    best = c;
    chosen.assign(loop.begin(), loop.end());
  }
  Exact flattest = 0.43L;
  for (std::uint32_t e = 0; e < piece.edge_count && (chosen.empty() || chosen.size() == 2); ++e) {
    const EdgeRecord& edge = piece.edges[e];
    if (edge.vertex[0] != support && edge.vertex[1] != support) continue;
    const Vector way =
        point_of(piece, is_a, edge.vertex[1]) - point_of(piece, is_a, edge.vertex[0]);
    const Exact slope = std::abs(way.normalized().dot(out));
    const bool both = near_top(edge.vertex[0]) && near_top(edge.vertex[1]);
    if (both && std::abs(slope - flattest) < 1e-6L) doubtful_ = true;
    if (!both || slope >= flattest) continue;
    flattest = slope;
    chosen = {edge.vertex[0], edge.vertex[1]};
  }
  if (chosen.empty()) chosen = {support};
  Feature feature;
  if (is_a && chosen.size() > 2) std::reverse(chosen.begin(), chosen.end());
  for (const std::uint32_t v : chosen) {
    const Vector p = point_of(piece, is_a, v);
    feature.corners.push_back({e1_.dot(p), e2_.dot(p)});
    feature.heights.push_back(n_.dot(p));
  }
  return feature;
}

std::vector<PlaneId> all_planes(const PairView& pair) {
  std::vector<PlaneId> planes;
  for (std::uint32_t f = 0; f < pair.a.face_count; ++f)
    planes.push_back({ContactType::kA, static_cast<std::uint16_t>(f), 0, false});
  for (std::uint32_t f = 0; f < pair.b.face_count; ++f)
    planes.push_back({ContactType::kB, 0, static_cast<std::uint16_t>(f), false});
  for (std::uint32_t e = 0; e < pair.a.edge_count; ++e) {
    for (std::uint32_t g = 0; g < pair.b.edge_count; ++g) {
      for (const bool flipped : {false, true}) {
        planes.push_back({ContactType::kC, static_cast<std::uint16_t>(e),
                          static_cast<std::uint16_t>(g), flipped});
      }
    }
  }
  return planes;
}

}  // namespace haptic::test
