// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The contact of one pair as geometry for whoever shows or records it: plane, frame, polygon H and
/// the basic contacts by the numbers of the user's mesh (paper Sec. IV; METHOD section 5). Formed
/// on demand from what a tick has left behind; no law uses it.

#include <cstdint>
#include <span>

#include "rt_core/base/bounded_list.hpp"
#include "rt_core/contact/contact_situation.hpp"
#include "rt_core/scene/graph_rule.hpp"
#include "rt_core/tracking/near_set.hpp"
#include "rt_core/tracking/planar_hull.hpp"

namespace haptic {

/// "No such feature in the mesh": a cut of the decomposition made it.
inline constexpr std::int32_t kMadeByCut = -1;

/// A feature of a convex piece by the numbers, from 0, of the mesh file of its body.
struct MeshFeature {
  FeatureKind kind = FeatureKind::kVertex;
  /// kVertex: the vertex, twice. kEdge: its two ends, ascending. kFace: the face, twice; of
  /// coplanar mesh faces that are one face of the piece, one. kMadeByCut where the mesh has none.
  std::int32_t source[2] = {kMadeByCut, kMadeByCut};

  friend bool operator==(const MeshFeature&, const MeshFeature&) = default;
};

/// A basic contact: type A face-vertex, type B vertex-face, type C edge-edge.
struct ContactId {
  ContactType type = ContactType::kA;
  MeshFeature of_a, of_b;

  friend bool operator==(const ContactId&, const ContactId&) = default;
};

/// The contact of one pair. Vectors in W axes. Where there is no contact: situation kNone, lists
/// empty, vectors zero.
struct ContactGeometry {
  ContactSituation situation = ContactSituation::kNone;  ///< settled, as PairReport has it
  std::uint32_t body_b = 0;                              ///< static body of the pair
  Real d_near_m = 0;                                     ///< <= 0 in contact
  Vec3 normal_w = Vec3::Zero();                          ///< n, unit, out of B
  Vec3 x0_w = Vec3::Zero();                              ///< x_0^A of this configuration, in W [m]
  Vec3 pi_w = Vec3::Zero();     ///< pi(x_0^A), a point of the plane, about x_0^A [m]
  Vec3 point_w = Vec3::Zero();  ///< the same point in W [m]
  /// Contact frame, right-handed with n as z: e1 along the contact edge or the side of H nearest to
  /// pi, then e2 points into H; any where H is a point.
  Vec3 e1_w = Vec3::Zero(), e2_w = Vec3::Zero();
  /// H: hull of the application points in the plane, about x_0^A, counter-clockwise seen against n
  /// [m]. Corners closer than max(epsilon, applicability_tolerance) are one; what is narrower than
  /// that is a segment or a point. Several planes: of the plane given here.
  BoundedList<Vec3> polygon_w;
  /// All basic contacts whose point lies in both features, those of other planes too; in the order
  /// of PairReport::contact_nodes.
  BoundedList<ContactId> ids;
  bool cut = false;  ///< a list had no room for all
};

/// What a tick leaves behind of a pair that touches.
struct ContactNodes {
  std::span<const NearNode> near;        ///< located
  std::span<const std::uint32_t> nodes;  ///< those with their point in both features, same order
  Real d_near_m = 0;
  ContactSituation situation = ContactSituation::kNone;
  Real epsilon_m = 0;
};

/// The basic contact (type, i, j) of a pair by the user's numbers. Cost: constant.
[[nodiscard]] ContactId contact_id(const PairView& pair, ContactType type, std::uint32_t i,
                                   std::uint32_t j) noexcept;

/// Empties the result and keeps its room.
void forget_contact(ContactGeometry& out) noexcept;

/// Fills `out`, which has been emptied. `scratch`: room for the near nodes. Cost: near nodes, and
/// O(K log K) of the K points.
void describe_contact(const PairView& pair, const ContactNodes& contact, const Vec3& x0_w,
                      const HullScratch& scratch, ContactGeometry& out) noexcept;

}  // namespace haptic
