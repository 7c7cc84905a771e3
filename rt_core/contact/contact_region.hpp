// SPDX-License-Identifier: Apache-2.0
#pragma once
/// From a near set to what touches: the basic contacts whose point lies in both features, their
/// application points, the common plane and the contact situation (paper Sec. IV; method section 6,
/// rows 7-9 and 15).

#include <cstdint>

#include "rt_core/base/bounded_list.hpp"
#include "rt_core/contact/contact_situation.hpp"
#include "rt_core/contact/contact_tracker.hpp"

namespace haptic {

/// Near C-faces whose normals differ by less than this angle are one contact plane, the others
/// several planes (method section 6, row 7). [rad], squared chord used.
inline constexpr Real kCoplanarAngle_rad = 0.05_r;

/// The contact of one pair, or the merged contact of several pairs that share a plane. Points are
/// about x_0^A in W axes.
struct ContactPatch {
  Vec3 normal_w = Vec3::Zero();   ///< outward unit normal of the contact plane
  Real d_near_m = 0;              ///< <= 0
  std::uint32_t body_b = 0;       ///< static body
  std::uint32_t point_begin = 0;  ///< in the list of points
  std::uint32_t point_count = 0;  ///< K distinct application points
  ContactSituation situation = ContactSituation::kNone;
  Real size_m = 0;            ///< scale of rounding: sum of the pieces' radii
  Real merge_distance_m = 0;  ///< points closer than this are one
};

/// Collects the contact of a colliding pair: appends its distinct application points to `points`
/// and its contact node numbers to `nodes` (ascending). Cost: near nodes x (sides of a face +
/// points). `several_planes` is set when near nodes of other planes were left out.
[[nodiscard]] ContactPatch make_contact_patch(const PairPose& pose, const PairTrack& track,
                                              Real epsilon_m, BoundedList<Vec3>& points,
                                              BoundedList<std::uint32_t>& nodes,
                                              bool& several_planes) noexcept;

}  // namespace haptic
