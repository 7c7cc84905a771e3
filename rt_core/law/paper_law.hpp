// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The published force and torque: paper Sec. IV, eqs. (1)-(6), with the open points settled as in
/// METHOD section 6.

#include <span>

#include "rt_core/base/pose.hpp"
#include "rt_core/tracking/contact_region.hpp"
#include "rt_core/tracking/planar_hull.hpp"

namespace haptic {

/// Wrench of one contact patch about x_0^A: F = -k_F D n (2); torque of one point by (3), of
/// several by (4)-(6) in the contact frame; zero torque when pi(x_0^A) lies in the contact region H
/// of a face-face contact. `points_w` are the K distinct application points about x_0^A. Cost: one
/// planar hull of K points, O(K log K).
[[nodiscard]] Wrench paper_wrench(const ContactPatch& patch, std::span<const Vec3> points_w,
                                  Real k_f_n_per_m, Real size_m,
                                  const HullScratch& scratch) noexcept;

}  // namespace haptic
