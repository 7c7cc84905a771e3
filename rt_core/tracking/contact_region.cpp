// SPDX-License-Identifier: Apache-2.0
#include "rt_core/tracking/contact_region.hpp"

#include <algorithm>
#include <cmath>

namespace haptic {
namespace {

bool coplanar(const NearNode& l, const NearNode& r, Real angle_rad) noexcept {
  return (l.normal_w - r.normal_w).squaredNorm() < angle_rad * angle_rad;
}

Real measure(const NearNode& n, Real d_near_m) noexcept {
  return std::abs(n.f_m - d_near_m) + std::max(n.violation_m, Real{0});
}

/// The node that names the plane: its point lies in both features. At exact ties the rounding
/// winner may be a type-C node of nearly parallel edges, whose crossing point is far away (METHOD
/// section 6, row 15); faces go first, for their normals are exact.
const NearNode* leader_of(std::span<const NearNode> near, Real d_near_m,
                          Real tolerance_m) noexcept {
  const NearNode* leader = nullptr;
  Real leader_key = 0;
  for (const NearNode& n : near) {
    const Real key = std::max(Real{0}, n.outside_m - tolerance_m) + measure(n, d_near_m) +
                     (n.type == ContactType::kC ? tolerance_m : Real{0});
    if (leader == nullptr || key < leader_key || (key == leader_key && n.node < leader->node)) {
      leader = &n;
      leader_key = key;
    }
  }
  return leader;
}

/// Scale of a node's coordinates for rounding: that of App and the plane.
Real rounding_of(Real epsilon_m) noexcept { return 1.0e-6_r * epsilon_m; }

}  // namespace

void locate_contacts(const PairPose& pose, std::span<NearNode> near, bool complete) noexcept {
  for (NearNode& n : near) {
    NodePlane plane;
    plane.normal_w = n.normal_w;
    plane.f_m = n.f_m;
    if (complete &&
        near.size() == 1) {  // the nearest C-face holds its SCP: App lies in both features
      n.app_w = application_point(pose, n.type, n.i, n.j, plane);
      n.outside_m = 0;
      return;
    }
    const ContactPoint point = contact_point(pose, n.type, n.i, n.j, plane);
    n.app_w = point.app_w;
    n.outside_m = point.outside_m;
  }
}

const NearNode* plane_node(std::span<const NearNode> near, Real d_near_m, Real size_m) noexcept {
  if (near.size() == 1) return near.data();
  return leader_of(near, d_near_m, applicability_tolerance(size_m));
}

ContactPatch make_contact_patch(const PairPose& pose, std::span<const NearNode> near, Real d_near_m,
                                Real epsilon_m, BoundedList<std::uint32_t>& nodes,
                                bool& several_planes) noexcept {
  const Real tolerance = std::max(epsilon_m, applicability_tolerance(pose.size_m));
  ContactPatch patch;
  patch.body_b = pose.pair->b.record->body;
  patch.d_near_m = d_near_m;
  patch.size_m = pose.size_m;
  patch.merge_distance_m = tolerance;
  several_planes = false;
  const NearNode* const leader = plane_node(near, d_near_m, pose.size_m);
  if (leader == nullptr) return patch;
  patch.normal_w = leader->normal_w;
  if (leader->type != ContactType::kC) {
    const bool of_a = leader->type == ContactType::kA;
    const FaceRecord& face = of_a ? pose.pair->a.faces[leader->i] : pose.pair->b.faces[leader->j];
    patch.plane = {face.plane, face.sign, of_a};
  }
  if (near.size() == 1) {
    static_cast<void>(nodes.push(leader->node));
    return patch;
  }
  for (const NearNode& n : near) {
    if (n.outside_m > tolerance && &n != leader) continue;
    static_cast<void>(nodes.push(n.node));
    several_planes = several_planes || !coplanar(n, *leader, kCoplanarAngle_rad);
  }
  return patch;
}

void collect_points(std::span<const NearNode> near, Real epsilon_m, BoundedList<Vec3>& points,
                    ContactPatch& patch) noexcept {
  const Real tolerance = patch.merge_distance_m;
  patch.point_begin = points.size();
  const NearNode* const leader = leader_of(near, patch.d_near_m, rounding_of(epsilon_m));
  for (const NearNode& n : near) {
    const Real chord2 = (n.normal_w - patch.normal_w).squaredNorm();
    if ((n.outside_m > tolerance && &n != leader) ||
        chord2 >= kCoplanarAngle_rad * kCoplanarAngle_rad) {
      continue;
    }
    bool known = false;
    for (std::uint32_t k = patch.point_begin; k < points.size(); ++k) {
      known = known || (points[k] - n.app_w).squaredNorm() <= tolerance * tolerance;
    }
    if (!known && points.push(n.app_w)) patch.point_count += 1;
  }
}

ContactSituation situation_of(std::span<const NearNode> near, Real d_near_m, Real epsilon_m,
                              Real share) noexcept {
  const Real tolerance = share * epsilon_m;
  const NearNode* const leader = leader_of(near, d_near_m, rounding_of(epsilon_m));
  if (leader == nullptr) return ContactSituation::kNone;
  const auto touches = [&](const NearNode& n) {
    return &n == leader || (n.outside_m <= tolerance && measure(n, d_near_m) < tolerance);
  };
  // The point farthest from the leader's, then the one farthest from the line through both.
  const NearNode* far = leader;
  for (const NearNode& n : near) {
    if (!touches(n)) continue;
    if (!coplanar(n, *leader, share * kCoplanarAngle_rad)) return ContactSituation::kSeveralPlanes;
    if ((n.app_w - leader->app_w).squaredNorm() > (far->app_w - leader->app_w).squaredNorm()) {
      far = &n;
    }
  }
  const Vec3 span = far->app_w - leader->app_w;
  const Real length = std::sqrt(span.squaredNorm());
  if (length <= tolerance) return single_contact(leader->type);
  for (const NearNode& n : near) {
    if (!touches(n)) continue;
    const Vec3 aside = span.cross(n.app_w - leader->app_w);
    if (aside.squaredNorm() > tolerance * tolerance * length * length) {
      return ContactSituation::kFaceFace;
    }
  }
  return ContactSituation::kEdgeFace;
}

ContactSituation settled_situation(std::span<const NearNode> near, Real d_near_m, Real epsilon_m,
                                   ContactSituation last) noexcept {
  if (near.size() == 1) return single_contact(near[0].type);
  const ContactSituation loose = situation_of(near, d_near_m, epsilon_m, 1);
  if (loose == last) return last;
  const ContactSituation tight = situation_of(near, d_near_m, epsilon_m, 0.5_r);
  return tight == last ? last : loose;
}

}  // namespace haptic
