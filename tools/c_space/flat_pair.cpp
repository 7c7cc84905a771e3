// SPDX-License-Identifier: Apache-2.0
#include "tools/c_space/flat_pair.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace haptic::tools {
namespace {

Point rotated(const std::array<Point, 3>& r, const Point& v) {
  return {dot(r[0], v), dot(r[1], v), dot(r[2], v)};
}
Point point_of(const ConstVec3Map& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

}  // namespace

PlacedMoving place_moving(const SceneView& view, const Pose& pose_wa) {
  const Quat& q = pose_wa.q_wa;
  double w = static_cast<double>(q.w()), x = static_cast<double>(q.x());
  double y = static_cast<double>(q.y()), z = static_cast<double>(q.z());
  const double s = 1.0 / std::sqrt(w * w + x * x + y * y + z * z);
  w *= s, x *= s, y *= s, z *= s;
  PlacedMoving moving;
  moving.r_wa[0] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)};
  moving.r_wa[1] = {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)};
  moving.r_wa[2] = {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)};
  const double* g = view.bodies()[0].reference_m;
  const Point p{static_cast<double>(pose_wa.p_wa[0]), static_cast<double>(pose_wa.p_wa[1]),
                static_cast<double>(pose_wa.p_wa[2])};
  moving.grip_w = p + rotated(moving.r_wa, {g[0], g[1], g[2]});
  return moving;
}

FlatPair::FlatPair(const SceneView& view, PairIndex pair) : view_(view.pair(pair)) {
  const double* reference = view.bodies()[view_.b.record->body].reference_m;
  reference_b_ = {reference[0], reference[1], reference[2]};
  const auto normal_of = [](const PieceView& piece, std::uint32_t f) {
    const Vec3 n = piece.face_normal(f);
    return Point{static_cast<double>(n[0]), static_cast<double>(n[1]), static_cast<double>(n[2])};
  };
  for (std::uint32_t v = 0; v < view_.a.vertex_count; ++v)
    va_local_.push_back(point_of(view_.a.vertex(v)));
  for (std::uint32_t f = 0; f < view_.a.face_count; ++f) na_local_.push_back(normal_of(view_.a, f));
  for (std::uint32_t v = 0; v < view_.b.vertex_count; ++v)
    vb_.push_back(point_of(view_.b.vertex(v)));
  for (std::uint32_t f = 0; f < view_.b.face_count; ++f) nb_.push_back(normal_of(view_.b, f));
  for (std::uint32_t e = 0; e < view_.b.edge_count; ++e) {
    ub_.push_back(vb_[view_.b.edges[e].vertex[1]] - vb_[view_.b.edges[e].vertex[0]]);
  }
  va_.resize(va_local_.size());
  na_.resize(na_local_.size());
  ua_.resize(view_.a.edge_count);
}

void FlatPair::place(const PlacedMoving& moving) {
  grip_ = moving.grip_w - reference_b_;
  for (std::size_t v = 0; v < va_.size(); ++v) va_[v] = grip_ + rotated(moving.r_wa, va_local_[v]);
  for (std::size_t f = 0; f < na_.size(); ++f) na_[f] = rotated(moving.r_wa, na_local_[f]);
  for (std::size_t e = 0; e < ua_.size(); ++e) {
    const EdgeRecord& edge = view_.a.edges[e];
    ua_[e] = rotated(moving.r_wa, va_local_[edge.vertex[1]] - va_local_[edge.vertex[0]]);
  }
}

FlatPair::Value FlatPair::evaluate_c(std::uint32_t e, std::uint32_t g, Point& normal) const {
  const EdgeRecord &ea = view_.a.edges[e], &eb = view_.b.edges[g];
  const Point &u = ua_[e], &v = ub_[g];
  const Point m = cross(u, v);
  const double m_squared = dot(m, m);
  if (m_squared <= kParallelSine * kParallelSine * dot(u, u) * dot(v, v)) {
    return {0.0, std::numeric_limits<double>::infinity()};
  }
  const Point &a0 = va_[ea.vertex[0]], &b0 = vb_[eb.vertex[0]];
  const double hb0 = dot(m, vb_[eb.apex[0]] - b0), hb1 = dot(m, vb_[eb.apex[1]] - b0);
  const double ha0 = -dot(m, va_[ea.apex[0]] - a0), ha1 = -dot(m, va_[ea.apex[1]] - a0);
  const double plus = std::max(std::max(hb0, hb1), std::max(ha0, ha1));
  const double minus = -std::min(std::min(hb0, hb1), std::min(ha0, ha1));
  const double inverse = (minus < plus ? -1.0 : 1.0) / std::sqrt(m_squared);
  normal = scaled(inverse, m);
  return {dot(normal, a0 - b0), std::min(plus, minus) * std::abs(inverse)};
}

FlatPair::Value FlatPair::evaluate(std::uint32_t node) const {
  const NodeFeatures features = node_features(view_, node);
  Value value{0.0, -std::numeric_limits<double>::infinity()};
  switch (contact_type(view_.record, node)) {
    case ContactType::kA: {
      const Point n = scaled(-1.0, na_[features.i]);
      const Point& b = vb_[features.j];
      value.depth_m = dot(n, va_[view_.a.face_vertices(features.i)[0]] - b);
      for (const std::uint16_t e : view_.b.edges_at(features.j)) {
        value.violation_m =
            std::max(value.violation_m, dot(n, vb_[view_.b.other_end(e, features.j)] - b));
      }
      return value;
    }
    case ContactType::kB: {
      const Point& n = nb_[features.j];
      const Point& a = va_[features.i];
      value.depth_m = dot(n, a - vb_[view_.b.face_vertices(features.j)[0]]);
      for (const std::uint16_t e : view_.a.edges_at(features.i)) {
        value.violation_m =
            std::max(value.violation_m, -dot(n, va_[view_.a.other_end(e, features.i)] - a));
      }
      return value;
    }
    case ContactType::kC:
      break;
  }
  Point normal{};
  return evaluate_c(features.i, features.j, normal);
}

double FlatPair::exhaustive_d_near_m(double tolerance_m) const {
  double largest = -std::numeric_limits<double>::infinity();
  for (std::uint32_t f = 0; f < view_.a.face_count; ++f) {
    const Point n = scaled(-1.0, na_[f]);
    const Point& a = va_[view_.a.face_vertices(f)[0]];
    for (std::uint32_t v = 0; v < view_.b.vertex_count; ++v) {
      const double depth = dot(n, a - vb_[v]);
      if (depth <= largest) continue;
      bool applicable = true;
      for (const std::uint16_t e : view_.b.edges_at(v)) {
        applicable = applicable && dot(n, vb_[view_.b.other_end(e, v)] - vb_[v]) <= tolerance_m;
      }
      if (applicable) largest = depth;
    }
  }
  for (std::uint32_t f = 0; f < view_.b.face_count; ++f) {
    const Point& n = nb_[f];
    const Point& b = vb_[view_.b.face_vertices(f)[0]];
    for (std::uint32_t v = 0; v < view_.a.vertex_count; ++v) {
      const double depth = dot(n, va_[v] - b);
      if (depth <= largest) continue;
      bool applicable = true;
      for (const std::uint16_t e : view_.a.edges_at(v)) {
        applicable = applicable && -dot(n, va_[view_.a.other_end(e, v)] - va_[v]) <= tolerance_m;
      }
      if (applicable) largest = depth;
    }
  }
  for (std::uint32_t e = 0; e < view_.a.edge_count; ++e) {
    for (std::uint32_t g = 0; g < view_.b.edge_count; ++g) {
      // The cheapest half of the sign test first: both faces of the edge of B on one side of the
      // plane.
      const EdgeRecord& eb = view_.b.edges[g];
      const Point& b0 = vb_[eb.vertex[0]];
      const Point m = cross(ua_[e], ub_[g]);
      const double h0 = dot(m, vb_[eb.apex[0]] - b0), h1 = dot(m, vb_[eb.apex[1]] - b0);
      const double slack = tolerance_m * (std::abs(m[0]) + std::abs(m[1]) + std::abs(m[2]));
      if ((h0 > slack && h1 < -slack) || (h0 < -slack && h1 > slack)) continue;
      Point normal{};
      const Value value = evaluate_c(e, g, normal);
      if (value.violation_m <= tolerance_m) largest = std::max(largest, value.depth_m);
    }
  }
  return largest;
}

void FlatPair::contact(std::uint32_t node, Point& normal, Point& application_point) const {
  const NodeFeatures features = node_features(view_, node);
  switch (contact_type(view_.record, node)) {
    case ContactType::kA:
      normal = scaled(-1.0, na_[features.i]);
      application_point = vb_[features.j];
      return;
    case ContactType::kB: {
      normal = nb_[features.j];
      const Point& a = va_[features.i];
      application_point = a - scaled(evaluate(node).depth_m, normal);
      return;
    }
    case ContactType::kC:
      break;
  }
  static_cast<void>(evaluate_c(features.i, features.j, normal));
  // Crossing of the edge of B with the plane through the edge of A and the normal: closest point of
  // the two lines.
  const Point &u = ua_[features.i], &v = ub_[features.j];
  const Point &a0 = va_[view_.a.edges[features.i].vertex[0]],
              &b0 = vb_[view_.b.edges[features.j].vertex[0]];
  const Point m = cross(u, v);
  const double s = dot(cross(a0 - b0, u), m) / -dot(m, m);
  application_point = b0 + scaled(s, v);
}

double FlatPair::largest_lever_m() const {
  double largest = 0.0;
  for (const Point& a : va_) {
    for (const Point& b : vb_) largest = std::max(largest, dot(a - b, a - b));
  }
  return std::sqrt(largest);
}

}  // namespace haptic::tools
