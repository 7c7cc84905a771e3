// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/way_gap.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace haptic {

Real gap_on_way_m(const WayEnds& ends, Real lever_m, const Vec3& dx_m,
                  const Vec3& dtheta_rad) noexcept {
  const Real turn = std::sqrt(dtheta_rad.squaredNorm());
  const Vec3 change = ends.normal_q_w - ends.normal_p_w;
  const Real change2 = change.squaredNorm();
  if (!(change2 < 1) || ends.normal_p_w.isZero(0)) return -std::numeric_limits<Real>::max();
  const Real across2 = std::max(ends.normal_q_w.cross(dtheta_rad).squaredNorm(),
                                ends.normal_p_w.cross(dtheta_rad).squaredNorm());
  Real curvature = 0;
  Real length = 1;
  if (change2 > 0) {
    curvature = 2 * (std::abs(change.dot(dx_m)) + std::sqrt(change2) * lever_m * turn);
    length = std::sqrt(1 - change2 / 4);
  }
  curvature += lever_m * turn * std::sqrt(across2);
  const Real rise = ends.gap_q_m - ends.gap_p_m;
  Real least = std::min(ends.gap_p_m, ends.gap_q_m);
  if (2 * std::abs(rise) < curvature) {
    const Real slope = rise - curvature / 2;
    least = ends.gap_p_m - slope * slope / (2 * curvature);
  }
  return least < 0 ? least / length : least;
}

}  // namespace haptic
