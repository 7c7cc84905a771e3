// SPDX-License-Identifier: Apache-2.0
#include "rt_core/base/plane_point.hpp"

#include <cmath>

namespace haptic {

Real norm(const PlanePoint& p) noexcept { return std::sqrt(dot(p, p)); }

PlaneBasis plane_basis(const Vec3& n) noexcept {
  const Real ax = std::abs(n[0]), ay = std::abs(n[1]), az = std::abs(n[2]);
  const Vec3 least = ax <= ay && ax <= az ? Vec3(1, 0, 0)
                     : ay <= az           ? Vec3(0, 1, 0)
                                          : Vec3(0, 0, 1);
  const Vec3 e1 = least.cross(n).normalized();
  return {e1, n.cross(e1)};
}

}  // namespace haptic
