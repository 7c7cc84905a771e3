// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/c_face_plane.hpp"

#include <cmath>

namespace haptic {

Vec3 plane_normal(const PairView& pair, const Mat3& r_wa, const PlaneId& id) noexcept {
  switch (id.type) {
    case ContactType::kA:
      return r_wa * -pair.a.plane_normal(id.i);
    case ContactType::kB:
      return pair.b.plane_normal(id.j);
    case ContactType::kC:
      break;
  }
  const Vec3 u = r_wa * ConstVec3Map(pair.a.edge_directions[id.i].unit);
  const Vec3 m = u.cross(ConstVec3Map(pair.b.edge_directions[id.j].unit));
  const Real sine = std::sqrt(m.squaredNorm());
  return sine < kMinEdgeSine ? Vec3(Vec3::Zero()) : Vec3(m / (id.flipped ? -sine : sine));
}

Real face_bound(const PairView& pair, const Mat3& r_wa, const Vec3& y_w, const PlaneId& id,
                SupportPair support) noexcept {
  const PieceView& a = pair.a;
  const PieceView& b = pair.b;
  if (id.type == ContactType::kA) {
    return a.plane_normal(id.i).dot(r_wa.transpose() * (b.vertex(support.b) - y_w)) -
           a.plane_offset(id.i) - pair.skin_m;
  }
  return b.plane_normal(id.j).dot(y_w + r_wa * a.vertex(support.a)) - b.plane_offset(id.j) -
         pair.skin_m;
}

DirectionGap direction_gap(const PairView& pair, const Mat3& r_wa, const Vec3& y_w,
                           const Vec3& normal_w, SupportPair start) noexcept {
  const Vec3 normal_a = r_wa.transpose() * normal_w;
  DirectionGap along;
  along.normal_w = normal_w;
  along.support.a = highest_vertex(pair.a, -normal_a, start.a);
  along.support.b = highest_vertex(pair.b, normal_w, start.b);
  along.gap_m = normal_w.dot(y_w - pair.b.vertex(along.support.b)) +
                normal_a.dot(pair.a.vertex(along.support.a)) - pair.skin_m;
  return along;
}

PlaneGap plane_gap(const PairView& pair, const Mat3& r_wa, const Vec3& y_w, const PlaneId& id,
                   SupportPair start) noexcept {
  const PieceView& a = pair.a;
  const PieceView& b = pair.b;
  PlaneGap plane;
  plane.id = id;
  plane.support = start;
  const ContactType type = id.type;
  switch (type) {
    case ContactType::kA:
      plane.normal_a = -a.plane_normal(id.i);
      plane.normal_w = r_wa * plane.normal_a;
      break;
    case ContactType::kB:
      plane.normal_w = b.plane_normal(id.j);
      plane.normal_a = r_wa.transpose() * plane.normal_w;
      break;
    case ContactType::kC: {
      const Vec3 u = r_wa * ConstVec3Map(a.edge_directions[id.i].unit);
      const Vec3 m = u.cross(ConstVec3Map(b.edge_directions[id.j].unit));
      const Real sine = std::sqrt(m.squaredNorm());
      if (sine < kMinEdgeSine) return plane;
      plane.normal_w = m / (id.flipped ? -sine : sine);
      plane.normal_a = r_wa.transpose() * plane.normal_w;
      break;
    }
  }
  plane.support.a =
      type == ContactType::kA ? a.plane_vertex(id.i) : highest_vertex(a, -plane.normal_a, start.a);
  plane.support.b =
      type == ContactType::kB ? b.plane_vertex(id.j) : highest_vertex(b, plane.normal_w, start.b);
  plane.gap_m = plane.normal_w.dot(y_w - b.vertex(plane.support.b)) +
                plane.normal_a.dot(a.vertex(plane.support.a)) - pair.skin_m;
  plane.defined = true;
  return plane;
}

}  // namespace haptic
