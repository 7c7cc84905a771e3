// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Points and axes of a plane in space.

#include "rt_core/base/scalar.hpp"

namespace haptic {

/// A point of a plane, about an origin that its user names. [m]
struct PlanePoint {
  Real x = 0, y = 0;
};

[[nodiscard]] constexpr PlanePoint operator-(const PlanePoint& l, const PlanePoint& r) noexcept {
  return {l.x - r.x, l.y - r.y};
}
[[nodiscard]] constexpr Real dot(const PlanePoint& l, const PlanePoint& r) noexcept {
  return l.x * r.x + l.y * r.y;
}
[[nodiscard]] constexpr Real cross(const PlanePoint& l, const PlanePoint& r) noexcept {
  return l.x * r.y - l.y * r.x;
}
[[nodiscard]] Real norm(const PlanePoint& p) noexcept;

/// Two unit vectors that make (e1, e2, n) right-handed; any will do, what is computed in the plane
/// does not depend on the choice.
struct PlaneBasis {
  Vec3 e1, e2;
};
/// `n`: unit. Cost: a root.
[[nodiscard]] PlaneBasis plane_basis(const Vec3& n) noexcept;

}  // namespace haptic
