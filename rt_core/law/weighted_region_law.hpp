// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The weighted contact region (METHOD section 8.2): the published wrench made continuous. Each
/// near C-face counts by how near it is and how far its application point lies in its features, so
/// that contacts come and go at zero weight; the torque is the least one of the region.

#include <span>

#include "rt_core/base/pose.hpp"
#include "rt_core/contact/planar_hull.hpp"

namespace haptic {

/// A near C-face as the law sees it.
struct WeightedContact {
  Vec3 normal_w = Vec3::Zero();  ///< outward unit normal
  Vec3 app_w = Vec3::Zero();     ///< App on B about x_0^A, W axes [m]
  Real weight = 0;               ///< contact_weight, 0 to 1
};

/// Weight w_k of a near C-face, 0 to 1: r((|f - D| + max(viol, 0)) / eps) r(o / eps_o) with r(t) =
/// clamp(1 - t, 0, 1). `violation_m`: largest height of a neighbouring vertex over the contact
/// plane; `outside_m`: distance of App from its two features when A is moved to the SCP.
/// `epsilon_m`, `epsilon_o_m` > 0. Lipschitz in every argument. Cost: two divisions.
[[nodiscard]] Real contact_weight(Real f_m, Real d_near_m, Real violation_m, Real outside_m,
                                  Real epsilon_m, Real epsilon_o_m) noexcept;

/// Wrench of one contact about x_0^A:
///   n_bar = sum w n / sum w        F = -k_F D n_bar
///   p_k = App_k projected on the plane through x_0^A square to n_bar, c = sum w p / sum w
///   q_k = c + w_k (p_k - c)        tau = (point of the hull of q_k closest to 0) x F
/// n_bar is not normalised: the two sides of a thin plate cancel. Where it vanishes, and where
/// there is no weight at all, force and torque are zero. One contact gives eqs. (2), (3).
/// `d_near_m` <= 0; `size_m`: scale of rounding; `scratch.points` has room for all contacts,
/// `scratch.hull` is not used. Duplicate and collinear points are welcome.
/// Cost: O(K) for K contacts, and closest_of_hull for K > 1.
[[nodiscard]] Wrench weighted_region_wrench(std::span<const WeightedContact> contacts,
                                            Real d_near_m, Real k_f_n_per_m, Real size_m,
                                            const HullScratch& scratch) noexcept;

}  // namespace haptic
