// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/basic_contact.hpp"

#include <algorithm>
#include <cmath>

namespace haptic {
namespace {

/// Heights of the two apex vertices of an edge of A over a plane through the edge, along n; >= 0
/// when applicable.
struct ApexHeights {
  Real low, high;
};
ApexHeights heights(Real h0, Real h1) noexcept { return {std::min(h0, h1), std::max(h0, h1)}; }

ApexHeights apex_heights_a(const PairPose& pose, std::uint32_t e, const Vec3& n) noexcept {
  const EdgeRecord& edge = pose.pair->a.edges[e];
  const auto origin = pose.vertex_a(edge.vertex[0]);
  return heights(n.dot(pose.vertex_a(edge.apex[0]) - origin),
                 n.dot(pose.vertex_a(edge.apex[1]) - origin));
}

ApexHeights apex_heights_b(const PairPose& pose, std::uint32_t g, const Vec3& n) noexcept {
  const EdgeRecord& edge = pose.pair->b.edges[g];
  const auto origin = pose.vertex_b(edge.vertex[0]);
  return heights(n.dot(pose.vertex_b(edge.apex[0]) - origin),
                 n.dot(pose.vertex_b(edge.apex[1]) - origin));
}

Real edge_violation(const ApexHeights& a, const ApexHeights& b) noexcept {
  return std::max(-a.low, b.high);
}

/// Distance of point p of the convex polygon's plane from the polygon; 0 inside. `vertex(k)` gives
/// the k-th corner, counter-clockwise about `normal`. Inside it is sign tests alone; outside, the
/// nearest side is one that has p on its outer hand.
template <typename VertexAt>
Real outside_polygon(const VertexAt& vertex, std::size_t count, const Vec3& normal,
                     const Vec3& p) noexcept {
  Real distance2 = 0;
  bool outside = false;
  Vec3 from = vertex(count - 1);
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3 to = vertex(k);
    const Vec3 side = to - from;
    const Vec3 to_p = p - from;
    const Real beyond = side.cross(normal).dot(to_p);  // > 0: on the outer hand
    if (beyond > 0) {
      const Real length2 = side.squaredNorm();
      const Real along = side.dot(to_p);
      const Real side2 = along <= 0         ? to_p.squaredNorm()
                         : along >= length2 ? (p - to).squaredNorm()
                                            : beyond * beyond / length2;
      distance2 = outside ? std::min(distance2, side2) : side2;
      outside = true;
    }
    from = to;
  }
  return outside ? std::sqrt(distance2) : Real{0};
}

}  // namespace

NodePlane node_plane(const PairPose& pose, ContactType type, std::uint32_t i,
                     std::uint32_t j) noexcept {
  NodePlane plane;
  const PieceView& a = pose.pair->a;
  const PieceView& b = pose.pair->b;
  switch (type) {
    case ContactType::kA:
      plane.normal_w = -pose.normal_a(i);
      plane.f_m = plane.normal_w.dot(pose.y_w - pose.vertex_b(j)) - a.face_offset(i);
      plane.defined = true;
      break;
    case ContactType::kB:
      plane.normal_w = b.face_normal(j);
      plane.f_m = plane.normal_w.dot(pose.y_w + pose.vertex_a(i)) - b.face_offset(j);
      plane.defined = true;
      break;
    case ContactType::kC: {
      const Vec3 m = pose.direction_a(i).cross(ConstVec3Map(b.edge_directions[j].unit));
      plane.sine = std::sqrt(m.squaredNorm());
      if (plane.sine < kMinEdgeSine) return plane;
      plane.normal_w = m / plane.sine;
      const ApexHeights ha = apex_heights_a(pose, i, plane.normal_w);
      const ApexHeights hb = apex_heights_b(pose, j, plane.normal_w);
      const Real as_is = edge_violation(ha, hb);
      const Real turned = edge_violation({-ha.high, -ha.low}, {-hb.high, -hb.low});
      if (turned < as_is) plane.normal_w = -plane.normal_w;
      plane.edge_violation_m = std::min(as_is, turned);
      plane.f_m = plane.normal_w.dot((pose.y_w - pose.vertex_b(b.edges[j].vertex[0])) +
                                     pose.vertex_a(a.edges[i].vertex[0]));
      plane.defined = true;
      break;
    }
  }
  return plane;
}

Real node_violation(const PairPose& pose, ContactType type, std::uint32_t i, std::uint32_t j,
                    const NodePlane& plane) noexcept {
  const PieceView& a = pose.pair->a;
  const PieceView& b = pose.pair->b;
  Real violation = -std::numeric_limits<Real>::max();
  switch (type) {
    case ContactType::kA:
      for (const std::uint16_t e : b.edges_at(j)) {
        violation = std::max(
            violation, plane.normal_w.dot(pose.vertex_b(b.other_end(e, j)) - pose.vertex_b(j)));
      }
      break;
    case ContactType::kB:
      for (const std::uint16_t e : a.edges_at(i)) {
        violation = std::max(
            violation, plane.normal_w.dot(pose.vertex_a(i) - pose.vertex_a(a.other_end(e, i))));
      }
      break;
    case ContactType::kC:
      violation = plane.edge_violation_m;  // the sign of the normal was chosen by it
      break;
  }
  return violation;
}

Real node_value(const PairPose& pose, ContactType type, std::uint32_t i, std::uint32_t j,
                const NodePlane& plane, Real violation_m) noexcept {
  const bool strict = type == ContactType::kC ? violation_m < -applicability_tolerance(pose.size_m)
                                              : violation_m <= 0;
  if (strict && plane.sine > kWellConditionedSine) return plane.f_m;
  const PieceView& a = pose.pair->a;
  const PieceView& b = pose.pair->b;
  SupportPair start;
  start.a = type == ContactType::kA   ? a.face_vertices(i)[0]
            : type == ContactType::kB ? i
                                      : a.edges[i].vertex[0];
  start.b = type == ContactType::kA   ? j
            : type == ContactType::kB ? b.face_vertices(j)[0]
                                      : b.edges[j].vertex[0];
  return std::min(plane.f_m,
                  gap_along(pose, plane.normal_w, support_pair(pose, plane.normal_w, start)));
}

Vec3 application_point(const PairPose& pose, ContactType type, std::uint32_t i, std::uint32_t j,
                       const NodePlane& plane) noexcept {
  if (type == ContactType::kA) return pose.vertex_b(j) - pose.y_w;
  const Vec3 lift = -plane.f_m * plane.normal_w;  // HIP to SCP, eq. (1)
  if (type == ContactType::kB) return pose.vertex_a(i) + lift;
  const PieceView& b = pose.pair->b;
  const Vec3 u = pose.direction_a(i);
  const Vec3 v = ConstVec3Map(b.edge_directions[j].unit);
  const Vec3 b0 = pose.vertex_b(b.edges[j].vertex[0]) - pose.y_w;
  const Vec3 m = u.cross(v);
  const Vec3 d = b0 - (pose.vertex_a(pose.pair->a.edges[i].vertex[0]) + lift);
  return b0 + (d.cross(u).dot(m) / m.squaredNorm()) * v;
}

ContactPoint contact_point(const PairPose& pose, ContactType type, std::uint32_t i, std::uint32_t j,
                           const NodePlane& plane) noexcept {
  const PieceView& a = pose.pair->a;
  const PieceView& b = pose.pair->b;
  const Vec3& n = plane.normal_w;
  const Vec3 lift = -plane.f_m * n;  // moves A onto the plane: HIP to SCP, eq. (1)
  ContactPoint point;
  switch (type) {
    case ContactType::kA: {
      point.app_w = pose.vertex_b(j) - pose.y_w;
      const auto loop = a.face_vertices(i);
      const Vec3 normal = -n;
      point.outside_m =
          outside_polygon([&](std::size_t k) -> Vec3 { return pose.vertex_a(loop[k]) + lift; },
                          loop.size(), normal, point.app_w);
      break;
    }
    case ContactType::kB: {
      point.app_w = pose.vertex_a(i) + lift;
      const auto loop = b.face_vertices(j);
      point.outside_m =
          outside_polygon([&](std::size_t k) -> Vec3 { return pose.vertex_b(loop[k]) - pose.y_w; },
                          loop.size(), n, point.app_w);
      break;
    }
    case ContactType::kC: {
      // Lines a0 + s u and b0 + t v, A lifted: they cross. s from the plane spanned by v and n, and
      // vice versa.
      const Vec3 u = pose.direction_a(i);
      const Vec3 v = ConstVec3Map(b.edge_directions[j].unit);
      const Vec3 a0 = pose.vertex_a(a.edges[i].vertex[0]) + lift;
      const Vec3 b0 = pose.vertex_b(b.edges[j].vertex[0]) - pose.y_w;
      const Vec3 m = u.cross(v);
      const Real m2 = m.squaredNorm();
      const Vec3 d = b0 - a0;
      const Real s = d.cross(v).dot(m) / m2;
      const Real t = d.cross(u).dot(m) / m2;
      const Real length_a = a.edge_directions[i].length_m;
      const Real length_b = b.edge_directions[j].length_m;
      point.app_w = b0 + t * v;
      point.outside_m = std::max({Real{0}, -s, s - length_a, -t, t - length_b});
      break;
    }
  }
  return point;
}

}  // namespace haptic
