// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The scalar of the core and its fixed-size linear algebra. `Real` is double (default) or float,
/// chosen for the whole build by the CMake variable HAPTIC_REAL because it changes layouts.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>

#ifndef HAPTIC_REAL_IS_FLOAT
#error "link the target haptic::rt_core: it defines HAPTIC_REAL_IS_FLOAT"
#endif

namespace haptic {

#if HAPTIC_REAL_IS_FLOAT
using Real = float;
#else
using Real = double;
#endif

/// Literal of the core's scalar: `1.0e-6_r`.
constexpr Real operator""_r(long double v) { return static_cast<Real>(v); }
constexpr Real operator""_r(unsigned long long v) { return static_cast<Real>(v); }

using Vec3 = Eigen::Matrix<Real, 3, 1, Eigen::DontAlign>;
using Mat3 = Eigen::Matrix<Real, 3, 3, Eigen::DontAlign>;
/// Hamilton quaternion, stored x y z w.
using Quat = Eigen::Quaternion<Real, Eigen::DontAlign>;

/// Distance from 1 to the next larger Real.
constexpr Real kRealEpsilon = std::numeric_limits<Real>::epsilon();

/// `value`; 0 where it is negative or not finite.
[[nodiscard]] constexpr Real non_negative(Real value) noexcept {
  return value - value == 0 && value > 0 ? value : Real{0};
}

/// Read-only view of three consecutive Reals of a flat table as a vector.
using ConstVec3Map = Eigen::Map<const Vec3>;

}  // namespace haptic
