// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Rotations without libm: sine, cosine, arc tangent, and exp/log of SO(3), as bounded polynomials
/// of our own. Every function is branch-bounded (no loops), allocation-free and deterministic; only
/// sqrt is taken from the compiler (it is one instruction). Accuracy: <= 2 ulp of the result
/// against long double over the stated range.

#include "rt_core/base/scalar.hpp"

namespace haptic {

/// sin(x), cos(x) for |x| <= kMaxTrigArgument [rad]. Outside the range, or for NaN: NaN.
constexpr Real kMaxTrigArgument_rad = 1.0e4_r;
[[nodiscard]] Real bounded_sin(Real angle_rad) noexcept;
[[nodiscard]] Real bounded_cos(Real angle_rad) noexcept;

/// atan2(y, x) in (-pi, pi], with the sign and zero rules of C. NaN in, NaN out.
[[nodiscard]] Real bounded_atan2(Real y, Real x) noexcept;

/// exp of SO(3): the unit quaternion of the rotation vector `rotation_rad` (axis times angle [rad],
/// |.| <= 1e4).
[[nodiscard]] Quat so3_exp(const Vec3& rotation_rad) noexcept;

/// log of SO(3): the rotation vector [rad] of the unit quaternion `q`, |result| <= pi; q and -q
/// give the same vector (at exactly pi the one with the first non-zero component of q's vector part
/// positive).
[[nodiscard]] Vec3 so3_log(const Quat& q) noexcept;

}  // namespace haptic
