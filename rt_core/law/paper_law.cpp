// SPDX-License-Identifier: Apache-2.0
#include "rt_core/law/paper_law.hpp"

namespace haptic {
namespace {

/// Sign class of a value: zero has its own (METHOD section 6, row 11).
int sign_class(Real value, Real zero) noexcept { return value > zero ? 1 : value < -zero ? -1 : 0; }

}  // namespace

Wrench paper_wrench(const ContactPatch& patch, std::span<const Vec3> points_w, Real k_f_n_per_m,
                    Real size_m, const HullScratch& scratch) noexcept {
  Wrench wrench;
  const Vec3& n = patch.normal_w;
  wrench.force_w = (-k_f_n_per_m * patch.d_near_m) * n;  // eqs. (1), (2)
  if (points_w.empty()) return wrench;
  if (points_w.size() == 1) {
    wrench.torque_w = points_w[0].cross(wrench.force_w);  // eq. (3): F x (x - App)
    return wrench;
  }
  const Real width = 16 * kRealEpsilon * size_m;
  const PlaneBasis basis = plane_basis(n);
  std::span<PlanePoint> points = scratch.points.first(points_w.size());
  for (std::size_t k = 0; k < points.size(); ++k)
    points[k] = {basis.e1.dot(points_w[k]), basis.e2.dot(points_w[k])};
  const std::uint32_t hull_size = convex_hull(points, scratch.hull, width);
  if (hull_size < 2) {
    wrench.torque_w = points_w[0].cross(wrench.force_w);
    return wrench;
  }
  const NearestSide nearest = nearest_side(scratch.hull.first(hull_size), width);
  if (nearest.inside) return wrench;  // pi(x_0^A) in H: zero torque
  const PlanePoint x_axis = nearest.axis;
  // Contact frame: x along the edge, z = n. A force F_n along z at (p_x, p_y) makes torque (p_y
  // F_n, -p_x F_n, 0).
  const Real f_n = -k_f_n_per_m * patch.d_near_m;
  const PlanePoint y_axis{-x_axis.y, x_axis.x};
  Real sum_x = 0, sum_y = 0;
  int first_sign = 0;
  bool equal_signs = true;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Real along = dot(x_axis, points[k]);
    const int sign = sign_class(-along, width);
    if (k == 0) first_sign = sign;
    equal_signs = equal_signs && sign == first_sign;
    sum_x += dot(y_axis, points[k]) * f_n;
    sum_y += -along * f_n;
  }
  const Real count = static_cast<Real>(points.size());
  const Real torque_x = sum_x / count;                          // eq. (6)
  const Real torque_y = equal_signs ? sum_y / count : Real{0};  // eq. (5)
  const Vec3 x_w = x_axis.x * basis.e1 + x_axis.y * basis.e2;
  const Vec3 y_w = y_axis.x * basis.e1 + y_axis.y * basis.e2;
  wrench.torque_w = torque_x * x_w + torque_y * y_w;  // eq. (4)
  return wrench;
}

}  // namespace haptic
