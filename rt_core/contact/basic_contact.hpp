// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Planes, values and applicability of basic contacts (paper Sec. II; METHOD section 2).

#include <cstdint>

#include "rt_core/contact/contact_situation.hpp"
#include "rt_core/contact/pair_pose.hpp"
#include "rt_core/contact/support.hpp"
#include "rt_core/scene/graph_rule.hpp"

namespace haptic {

/// A type-C node whose unit edge directions have |u x v| below this is skipped: sqrt of the unit
/// roundoff balances the rounding of its normal against the width of the strip that its C-face is
/// (METHOD section 11).
inline constexpr Real kMinEdgeSine = HAPTIC_REAL_IS_FLOAT ? 2.4e-4_r : 1.5e-8_r;

/// Below this sine a type-C value is taken from supports: the plane's own value could lie, a
/// support gap only lose.
inline constexpr Real kWellConditionedSine = 1.0e-3_r;

/// Tolerance of applicability [m] for a pair of the given size: ties are accepted, values then come
/// from supports, so the tolerance never makes a separation (METHOD section 6, row 6).
[[nodiscard]] constexpr Real applicability_tolerance(Real size_m) noexcept {
  constexpr Real kShare = 64 * kRealEpsilon > 1.0e-8_r ? 64 * kRealEpsilon : 1.0e-8_r;
  return kShare * size_m;
}

/// A node's C-face plane at the current pose.
struct NodePlane {
  Vec3 normal_w = Vec3::Zero();  ///< outward unit normal
  Real f_m = 0;                  ///< n.((x - b) + R a): positive outside
  Real sine = 1;                 ///< |u x v| for type C, 1 otherwise
  Real edge_violation_m = 0;     ///< type C: largest height over the plane [m]
  bool defined = false;          ///< false: parallel edges
};

/// Plane and value of node (type, i, j). Cost: a few dot products; type C also a square root.
/// For type C the sign of the normal is the one with the smaller violation.
[[nodiscard]] NodePlane node_plane(const PairPose& pose, ContactType type, std::uint32_t i,
                                   std::uint32_t j) noexcept;

/// Largest height [m] of a neighbouring vertex over the plane: 0 or less means applicable (METHOD
/// section 2). Cost: the degree of the vertex (types A and B), nothing for type C.
[[nodiscard]] Real node_violation(const PairPose& pose, ContactType type, std::uint32_t i,
                                  std::uint32_t j, const NodePlane& plane) noexcept;

/// Value that may count for D_near: f itself where the node is applicable beyond doubt, else the
/// support gap of its normal, which is a lower bound of the signed distance for any normal
/// [m].
[[nodiscard]] Real node_value(const PairPose& pose, ContactType type, std::uint32_t i,
                              std::uint32_t j, const NodePlane& plane, Real violation_m) noexcept;

/// A node of the pair and its application point.
struct ContactPoint {
  Vec3 app_w = Vec3::Zero();  ///< App on B, about x_0^A, W axes [m]
  Real outside_m =
      0;  ///< distance of App from its two features when A is moved to the SCP; 0 = in both
};

/// App of a node on B, about x_0^A, W axes [m]. Cost: two cross products at most.
[[nodiscard]] Vec3 application_point(const PairPose& pose, ContactType type, std::uint32_t i,
                                     std::uint32_t j, const NodePlane& plane) noexcept;

/// App of a node and how far it lies outside its features when A is moved to the SCP. Cost: the
/// edges of its face.
[[nodiscard]] ContactPoint contact_point(const PairPose& pose, ContactType type, std::uint32_t i,
                                         std::uint32_t j, const NodePlane& plane) noexcept;

/// The situation of one basic contact.
[[nodiscard]] constexpr ContactSituation single_contact(ContactType type) noexcept {
  return type == ContactType::kA   ? ContactSituation::kFaceVertex
         : type == ContactType::kB ? ContactSituation::kVertexFace
                                   : ContactSituation::kEdgeEdge;
}

/// Near C-faces whose normals differ by less than this angle are one contact plane, the others
/// several planes (METHOD section 6, row 7). [rad], squared chord used.
inline constexpr Real kCoplanarAngle_rad = 0.05_r;

}  // namespace haptic
