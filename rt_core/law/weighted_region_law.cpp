// SPDX-License-Identifier: Apache-2.0
#include "rt_core/law/weighted_region_law.hpp"

#include <algorithm>
#include <cmath>

namespace haptic {
namespace {

/// Shorter than this, n_bar is the rounding of normals that cancel and has no direction.
constexpr Real kNoNormal = 8 * kRealEpsilon;

/// The q_k in the contact plane: App drawn towards the weighted mean c as its weight falls, so that
/// a point enters and leaves the region at c.
void draw_to_mean(std::span<const WeightedContact> contacts, const PlaneBasis& basis,
                  Real weight_sum, std::span<PlanePoint> points) noexcept {
  Real sum_x = 0, sum_y = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const WeightedContact& contact = contacts[k];
    points[k] = {basis.e1.dot(contact.app_w), basis.e2.dot(contact.app_w)};
    sum_x += contact.weight * points[k].x;
    sum_y += contact.weight * points[k].y;
  }
  const PlanePoint mean{sum_x / weight_sum, sum_y / weight_sum};
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Real weight = contacts[k].weight;
    if (weight == 1) continue;  // p_k itself, without rounding
    const PlanePoint from_mean = points[k] - mean;
    points[k] = {mean.x + weight * from_mean.x, mean.y + weight * from_mean.y};
  }
}

}  // namespace

Real contact_weight(Real f_m, Real d_near_m, Real violation_m, Real outside_m, Real epsilon_m,
                    Real epsilon_o_m) noexcept {
  const Real behind_m = std::abs(f_m - d_near_m) + std::max(violation_m, Real{0});
  const Real near = std::clamp(1 - behind_m / epsilon_m, Real{0}, Real{1});
  const Real inside = std::clamp(1 - outside_m / epsilon_o_m, Real{0}, Real{1});
  return near * inside;
}

Wrench weighted_region_wrench(std::span<const WeightedContact> contacts, Real d_near_m,
                              Real k_f_n_per_m, Real size_m, const HullScratch& scratch) noexcept {
  Wrench wrench;
  Vec3 normal_sum = Vec3::Zero();
  Real weight_sum = 0;
  for (const WeightedContact& contact : contacts) {
    normal_sum += contact.weight * contact.normal_w;
    weight_sum += contact.weight;
  }
  if (!(weight_sum > 0)) return wrench;
  const Vec3 n_bar = normal_sum / weight_sum;
  if (!(n_bar.squaredNorm() > kNoNormal * kNoNormal)) return wrench;
  wrench.force_w = (-k_f_n_per_m * d_near_m) * n_bar;  // eq. (2), n_bar for n
  if (contacts.size() == 1) {
    wrench.torque_w = contacts[0].app_w.cross(wrench.force_w);  // eq. (3)
    return wrench;
  }
  const PlaneBasis basis = plane_basis(n_bar.normalized());
  const std::span<PlanePoint> points = scratch.points.first(contacts.size());
  draw_to_mean(contacts, basis, weight_sum, points);
  const PlanePoint arm = closest_of_hull(points, 4 * kRealEpsilon * size_m);
  wrench.torque_w = (arm.x * basis.e1 + arm.y * basis.e2).cross(wrench.force_w);
  return wrench;
}

}  // namespace haptic
