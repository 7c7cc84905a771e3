// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Three linear equations in three unknowns, in double for every scalar of the core: a device's
/// kinematics need residuals that single precision does not have.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace haptic::hal {

/// Column of three doubles; as an element of device kinematics it is named with its frame and unit.
using Column3 = Eigen::Matrix<double, 3, 1, Eigen::DontAlign>;
using Square3 = Eigen::Matrix<double, 3, 3, Eigen::DontAlign>;

[[nodiscard]] inline bool is_finite(const Column3& v) noexcept {
  return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}

/// Solves m x = b by Cramer's rule. False, `x` unchanged, where the determinant is below
/// `least_share` of the product of the rows' lengths (the rows then lie in a plane except for that
/// share), or where a number is not finite. Cost: constant.
[[nodiscard]] inline bool solve3(const Square3& m, const Column3& b, double least_share,
                                 Column3& x) noexcept {
  const Column3 r0 = m.row(0).transpose();
  const Column3 r1 = m.row(1).transpose();
  const Column3 r2 = m.row(2).transpose();
  const Column3 r12 = r1.cross(r2);
  const double determinant = r0.dot(r12);
  const double size = r0.norm() * r1.norm() * r2.norm();
  if (!(std::abs(determinant) > least_share * size)) return false;
  const Column3 sum = r12 * b.x() + r2.cross(r0) * b.y() + r0.cross(r1) * b.z();
  const Column3 found = sum / determinant;
  if (!is_finite(found)) return false;
  x = found;
  return true;
}

}  // namespace haptic::hal
