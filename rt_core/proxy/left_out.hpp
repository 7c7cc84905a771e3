// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Near pairs that a list has no slot for, in groups that look about one way: a motion is bounded
/// by what it takes from the gap of each group, so none of them is forgotten.

#include <cstdint>

#include "rt_core/base/scalar.hpp"

namespace haptic {

/// Pairs within the range of a list that it has no slot for, those taken together whose best faces
/// look about one way: along unit vectors n from B to A, fixed in W, no component of which differs
/// from that of `normal_w` by more than `spread` says. The same of the moments r x n about the grip
/// point, r any point of their pieces of A.
struct LeftOut {
  Vec3 normal_w = Vec3::Zero(), spread = Vec3::Zero();
  Vec3 moment_m = Vec3::Zero(), moment_spread_m = Vec3::Zero();
  Real reach_m = 0;  ///< lever of their pieces of A about the grip point, the largest
  Real gap_m = 0;    ///< along those vectors, a lower bound
};
/// What both hold.
[[nodiscard]] LeftOut joined(const LeftOut& left, const LeftOut& other) noexcept;
/// Such groups of one list at most; a further one joins another, or two of them join.
inline constexpr std::uint32_t kMostLeftOut = 16;

/// A turn by theta moves a point of lever v by theta x v but for this times |v| theta^2, theta up
/// to 1 rad: (1 - cos theta) and (theta - sin theta), over theta^2.
inline constexpr Real kTurnBend = 2.0_r / 3;

/// What a motion takes from the gap of a group at most, negative where it adds to it; no point of
/// the way there takes more than the larger of this and zero.
[[nodiscard]] Real taken_m(const LeftOut& left, const Vec3& dx_m, const Vec3& dtheta_rad) noexcept;

/// The part has moved by so much.
void follow(LeftOut& left, const Vec3& dx_m, const Vec3& dtheta_rad) noexcept;

}  // namespace haptic
