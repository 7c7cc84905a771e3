// SPDX-License-Identifier: Apache-2.0
#pragma once
/// C-face planes of a pair by what defines them, a face or two edges, and the gap between the two
/// pieces along them. Works in each piece's own axes: no turned vertices are needed, so a plane can
/// be asked about at any pose.

#include <cstdint>

#include "rt_core/contact/basic_contact.hpp"

namespace haptic {

/// A C-face plane of a pair, with any vertex or edge as its support.
struct PlaneId {
  ContactType type = ContactType::kA;
  std::uint16_t i = 0;   ///< kA: plane of A (PieceView); kC: edge of A; kB: 0
  std::uint16_t j = 0;   ///< kB: plane of B; kC: edge of B; kA: 0
  bool flipped = false;  ///< kC: the normal is -(u x v) / |u x v|

  friend bool operator==(const PlaneId&, const PlaneId&) = default;
};

/// A C-face plane at one pose and the gap along it.
struct PlaneGap {
  PlaneId id;
  Vec3 normal_w = Vec3::Zero();  ///< unit, from B to A
  Vec3 normal_a = Vec3::Zero();  ///< the same in A's axes
  /// n.x - h(n) less the pair's skin: for every normal a lower bound of what is left of the
  /// distance
  Real gap_m = 0;
  SupportPair support;   ///< vertices between which the gap is
  bool defined = false;  ///< false: edges too close to parallel, the rest means nothing
};

/// The gap between the pieces of a pair along any direction.
struct DirectionGap {
  Vec3 normal_w = Vec3::Zero();  ///< unit, from B to A
  Real gap_m = 0;                ///< as PlaneGap::gap_m
  SupportPair support;           ///< vertices between which the gap is
};

/// Unit normal of plane `id`, from B to A, when A is turned by `r_wa`; zero where it is not defined
/// or the part never turns.
[[nodiscard]] Vec3 plane_normal(const PairView& pair, const Mat3& r_wa, const PlaneId& id) noexcept;

/// Plane `id` and its gap when A is turned by `r_wa`. `y_w`: x_0^A minus the reference of B's body
/// [m]. `start`: vertices where the search for supports begins; any will do, the last ones are the
/// fastest. The support of a face is its first vertex, without search. Cost: one highest_vertex
/// (kA, kB) or two and a root (kC).
[[nodiscard]] PlaneGap plane_gap(const PairView& pair, const Mat3& r_wa, const Vec3& y_w,
                                 const PlaneId& id, SupportPair start) noexcept;

/// The gap along `normal_w`; else as plane_gap, not for a part that never turns. Cost: two
/// highest_vertex.
[[nodiscard]] DirectionGap direction_gap(const PairView& pair, const Mat3& r_wa, const Vec3& y_w,
                                         const Vec3& normal_w, SupportPair start) noexcept;

/// An upper bound of the gap along the plane of a face (kA, kB): that of one vertex of the other
/// piece, which `support` names [m].
[[nodiscard]] Real face_bound(const PairView& pair, const Mat3& r_wa, const Vec3& y_w,
                              const PlaneId& id, SupportPair support) noexcept;

}  // namespace haptic
