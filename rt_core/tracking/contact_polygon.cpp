// SPDX-License-Identifier: Apache-2.0
#include "rt_core/tracking/contact_polygon.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/tracking/contact_region.hpp"

namespace haptic {
namespace {

MeshFeature vertex_of(const PieceView& piece, std::uint32_t v) noexcept {
  return {FeatureKind::kVertex, {piece.source_vertices[v], piece.source_vertices[v]}};
}
MeshFeature edge_of(const PieceView& piece, std::uint32_t e) noexcept {
  const std::int32_t first = piece.source_vertices[piece.edges[e].vertex[0]];
  const std::int32_t second = piece.source_vertices[piece.edges[e].vertex[1]];
  return {FeatureKind::kEdge, {std::min(first, second), std::max(first, second)}};
}
MeshFeature face_of(const PieceView& piece, std::uint32_t f) noexcept {
  return {FeatureKind::kFace, {piece.faces[f].source_face, piece.faces[f].source_face}};
}

/// Keeps of neighbouring corners closer than `distance_m` the first; returns how many stay.
std::uint32_t merge_corners(std::span<PlanePoint> corners, Real distance_m) noexcept {
  std::uint32_t kept = 0;
  for (const PlanePoint& corner : corners) {
    if (kept > 0 && norm(corner - corners[kept - 1]) <= distance_m) continue;
    corners[kept++] = corner;
  }
  while (kept > 1 && norm(corners[kept - 1] - corners[0]) <= distance_m) --kept;
  return kept;
}

std::size_t farthest_from(const PlanePoint& from, std::span<const PlanePoint> corners) noexcept {
  std::size_t farthest = 0;
  Real most = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const PlanePoint way = corners[k] - from;
    if (dot(way, way) > most) {
      most = dot(way, way);
      farthest = k;
    }
  }
  return farthest;
}

/// A polygon narrower than `width_m` is the segment between its far ends.
std::uint32_t flatten_sliver(std::span<PlanePoint> corners, Real width_m) noexcept {
  const auto count = static_cast<std::uint32_t>(corners.size());
  if (count < 3) return count;
  const PlanePoint p = corners[farthest_from(corners[0], corners)];
  const PlanePoint q = corners[farthest_from(p, corners)];
  const PlanePoint along = q - p;
  const Real limit = width_m * norm(along);
  for (const PlanePoint& corner : corners) {
    if (std::abs(cross(along, corner - p)) > limit) return count;
  }
  corners[0] = p;
  corners[1] = q;
  return 2;
}

/// Corners of H about pi, in `scratch.hull`; returns how many. `points`: at least one.
std::uint32_t corners_of(std::span<PlanePoint> points, const HullScratch& scratch, Real width_m,
                         Real merge_distance_m) noexcept {
  scratch.hull[0] = points[0];
  if (points.size() == 1) return 1;
  const std::uint32_t size = convex_hull(points, scratch.hull, width_m);
  const std::uint32_t kept = merge_corners(scratch.hull.first(size), merge_distance_m);
  return flatten_sliver(scratch.hull.first(kept), merge_distance_m);
}

}  // namespace

ContactId contact_id(const PairView& pair, ContactType type, std::uint32_t i,
                     std::uint32_t j) noexcept {
  switch (type) {
    case ContactType::kA:
      return {type, face_of(pair.a, i), vertex_of(pair.b, j)};
    case ContactType::kB:
      return {type, vertex_of(pair.a, i), face_of(pair.b, j)};
    case ContactType::kC:
      break;
  }
  return {type, edge_of(pair.a, i), edge_of(pair.b, j)};
}

void forget_contact(ContactGeometry& out) noexcept {
  const BoundedList<Vec3> polygon = out.polygon_w;
  const BoundedList<ContactId> ids = out.ids;
  out = ContactGeometry{};
  out.polygon_w = polygon;
  out.polygon_w.clear();
  out.ids = ids;
  out.ids.clear();
}

void describe_contact(const PairView& pair, const ContactNodes& contact, const Vec3& x0_w,
                      const HullScratch& scratch, ContactGeometry& out) noexcept {
  const auto size_m = static_cast<Real>(pair.a.record->radius_m + pair.b.record->radius_m);
  const NearNode* const plane = plane_node(contact.near, contact.d_near_m, size_m);
  if (plane == nullptr) return;
  const Vec3& n = plane->normal_w;
  out.situation = contact.situation;
  out.body_b = pair.b.record->body;
  out.d_near_m = contact.d_near_m;
  out.normal_w = n;
  out.x0_w = x0_w;
  out.pi_w = n.dot(plane->app_w) * n;
  out.point_w = x0_w + out.pi_w;

  const PlaneBasis basis = plane_basis(n);
  std::uint32_t count = 0;
  std::size_t next = 0;  // both lists are in the order in which the search met the nodes
  for (const NearNode& node : contact.near) {
    if (next == contact.nodes.size() || contact.nodes[next] != node.node) continue;
    ++next;
    if (!out.ids.push(contact_id(pair, node.type, node.i, node.j))) out.cut = true;
    const Real chord2 = (node.normal_w - n).squaredNorm();
    if (chord2 >= kCoplanarAngle_rad * kCoplanarAngle_rad) continue;
    scratch.points[count++] = {basis.e1.dot(node.app_w), basis.e2.dot(node.app_w)};
  }
  if (count == 0) return;
  const Real merge_distance = std::max(contact.epsilon_m, applicability_tolerance(size_m));
  const Real width = 16 * kRealEpsilon * size_m;
  const std::uint32_t corners =
      corners_of(scratch.points.first(count), scratch, width, merge_distance);
  for (std::uint32_t k = 0; k < corners; ++k) {
    const PlanePoint& corner = scratch.hull[k];
    if (!out.polygon_w.push(out.pi_w + corner.x * basis.e1 + corner.y * basis.e2)) out.cut = true;
  }
  out.e1_w = basis.e1;
  if (corners > 1) {
    const PlanePoint axis = nearest_side(scratch.hull.first(corners), width).axis;
    out.e1_w = axis.x * basis.e1 + axis.y * basis.e2;
  }
  out.e2_w = n.cross(out.e1_w);
}

}  // namespace haptic
