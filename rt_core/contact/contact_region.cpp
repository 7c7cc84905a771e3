// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/contact_region.hpp"

#include <algorithm>
#include <cmath>

namespace haptic {
namespace {

ContactSituation single_contact(ContactType type) noexcept {
  switch (type) {
    case ContactType::kA:
      return ContactSituation::kFaceVertex;
    case ContactType::kB:
      return ContactSituation::kVertexFace;
    case ContactType::kC:
      return ContactSituation::kEdgeEdge;
  }
  return ContactSituation::kNone;
}

bool coplanar(const NearNode& l, const NearNode& r) noexcept {
  return (l.plane.normal_w - r.plane.normal_w).squaredNorm() <
         kCoplanarAngle_rad * kCoplanarAngle_rad;
}

/// Whether the points span a polygon rather than a segment.
bool spans_polygon(const Vec3* points, std::uint32_t count, Real width_m) noexcept {
  std::uint32_t far = 0;
  for (std::uint32_t k = 1; k < count; ++k) {
    if ((points[k] - points[0]).squaredNorm() > (points[far] - points[0]).squaredNorm()) far = k;
  }
  const Vec3 along = (points[far] - points[0]).normalized();
  for (std::uint32_t k = 1; k < count; ++k) {
    if (along.cross(points[k] - points[0]).squaredNorm() > width_m * width_m) return true;
  }
  return false;
}

}  // namespace

ContactPatch make_contact_patch(const PairPose& pose, const PairTrack& track, Real epsilon_m,
                                BoundedList<Vec3>& points, BoundedList<std::uint32_t>& nodes,
                                bool& several_planes) noexcept {
  const PairView& pair = *pose.pair;
  const Real tolerance = std::max(epsilon_m, applicability_tolerance(pose.size_m));
  const auto features = [&](const NearNode& n) -> const NodeRecord& { return pair.nodes[n.node]; };
  const auto point_of = [&](const NearNode& n) {
    return contact_point(pose, n.type, features(n).a, features(n).b, n.plane);
  };

  // The node that names the plane has its point in both features: at exact ties the rounding winner
  // may be a type-C node of nearly parallel edges, whose crossing point is far away (method section
  // 6, row 15).
  const NearNode* leader = nullptr;
  Real leader_key = 0;
  for (const NearNode& n : track.near) {
    const Real below = n.value_m < track.d_near_m ? track.d_near_m - n.value_m : Real{0};
    const bool counts = n.violation_m <= applicability_tolerance(pose.size_m) && below < tolerance;
    if (!counts && n.node != track.best_node) continue;
    const Real outside =
        std::max(Real{0}, point_of(n).outside_m - applicability_tolerance(pose.size_m));
    const Real key = outside + below +
                     (n.type == ContactType::kC ? applicability_tolerance(pose.size_m) : Real{0});
    if (leader == nullptr || key < leader_key) {
      leader = &n;
      leader_key = key;
    }
  }

  ContactPatch patch;
  patch.body_b = pair.b.record->body;
  patch.d_near_m = track.d_near_m;
  patch.point_begin = points.size();
  patch.size_m = pose.size_m;
  patch.merge_distance_m = tolerance;
  several_planes = false;
  if (leader == nullptr) return patch;
  patch.normal_w = leader->plane.normal_w;
  for (const NearNode& n : track.near) {
    const ContactPoint p = point_of(n);
    if (p.outside_m > tolerance && &n != leader) continue;
    if (!coplanar(n, *leader)) {
      several_planes = true;
      continue;
    }
    static_cast<void>(nodes.push(n.node));
    bool known = false;
    for (std::uint32_t k = patch.point_begin; k < points.size(); ++k) {
      known = known || (points[k] - p.app_w).squaredNorm() <= tolerance * tolerance;
    }
    if (!known && points.push(p.app_w)) patch.point_count += 1;
  }
  if (several_planes) {
    patch.situation = ContactSituation::kSeveralPlanes;
  } else if (patch.point_count <= 1) {
    patch.situation = single_contact(leader->type);
  } else {
    const bool polygon =
        spans_polygon(points.begin() + patch.point_begin, patch.point_count, tolerance);
    patch.situation = polygon ? ContactSituation::kFaceFace : ContactSituation::kEdgeFace;
  }
  return patch;
}

}  // namespace haptic
