// SPDX-License-Identifier: Apache-2.0
#pragma once
/// From a near set to what touches: application points, the basic contacts whose point lies in both
/// features, their common plane and the contact situation (paper Sec. IV; METHOD section 6, rows
/// 7-9 and 15).

#include <array>
#include <cstdint>
#include <span>

#include "rt_core/base/bounded_list.hpp"
#include "rt_core/contact/contact_situation.hpp"
#include "rt_core/tracking/near_set.hpp"

namespace haptic {

/// A face's plane within the planes of its body.
struct FacePlane {
  std::uint32_t plane = 0;
  std::int32_t sign = 0;  ///< 0: none
  bool of_a = false;
  bool operator==(const FacePlane&) const = default;
};

/// The contact of one pair, or the merged contact of several pairs that share a plane. Points are
/// about x_0^A in W axes.
struct ContactPatch {
  Vec3 normal_w = Vec3::Zero();  ///< outward unit normal of the contact plane
  Real d_near_m = 0;             ///< <= 0
  std::uint32_t body_b = 0;      ///< static body
  FacePlane plane;               ///< of the leader's face; none of an edge pair
  std::uint32_t near_begin = 0;  ///< near set, in the list of all near nodes
  std::uint32_t near_count = 0;
  std::uint32_t point_begin = 0;                         ///< in the list of points (paper's law)
  std::uint32_t point_count = 0;                         ///< K distinct application points
  ContactSituation situation = ContactSituation::kNone;  ///< exact, without hysteresis
  Real size_m = 0;            ///< scale of rounding: sum of the pieces' radii
  Real merge_distance_m = 0;  ///< points closer than this are one
};

/// Fills App and its distance from its features in every node of a near set. `complete`: the set is
/// that of all nodes of the pair, so that a single one holds its point. Cost: nodes x sides of a
/// face.
void locate_contacts(const PairPose& pose, std::span<NearNode> near, bool complete = true) noexcept;

/// The node of a located near set whose C-face is the contact plane: its point lies in both
/// features where any does (METHOD section 6, row 15). `size_m`: sum of the pieces' radii. Null
/// when `near` is empty. Cost: near nodes.
[[nodiscard]] const NearNode* plane_node(std::span<const NearNode> near, Real d_near_m,
                                         Real size_m) noexcept;

/// The contact plane of the located near set of a colliding pair; appends to `nodes` the
/// numbers of the basic contacts whose point lies in both features. Cost: near nodes.
/// `several_planes` is set when near nodes of other planes were left out.
[[nodiscard]] ContactPatch make_contact_patch(const PairPose& pose, std::span<const NearNode> near,
                                              Real d_near_m, Real epsilon_m,
                                              BoundedList<std::uint32_t>& nodes,
                                              bool& several_planes) noexcept;

/// Appends the distinct application points of the patch's basic contacts to `points` and counts
/// them in the patch (METHOD section 6, row 9). Cost: near nodes x points.
void collect_points(std::span<const NearNode> near, Real epsilon_m, BoundedList<Vec3>& points,
                    ContactPatch& patch) noexcept;

/// Contact situation of a located near set, judged with tolerances of `share` of epsilon.
[[nodiscard]] ContactSituation situation_of(std::span<const NearNode> near, Real d_near_m,
                                            Real epsilon_m, Real share) noexcept;

/// The label to be shown: the last one while tolerances between half of epsilon and epsilon still
/// give it, so that tremor does not make it chatter. Only the label waits; no value does.
[[nodiscard]] ContactSituation settled_situation(std::span<const NearNode> near, Real d_near_m,
                                                 Real epsilon_m, ContactSituation last) noexcept;

}  // namespace haptic
