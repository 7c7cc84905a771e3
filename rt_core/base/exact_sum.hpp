// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Sums and products as an unevaluated pair high + low, about twice the digits of Real, for the few
/// places where a sign decides and cancellation would take all digits. Error-free transformations
/// of Dekker and Knuth; they need the build's -ffp-contract=off and no wider registers.

#include "rt_core/base/scalar.hpp"

namespace haptic {

struct LongReal {
  Real high = 0, low = 0;
};

/// l + r exactly (Knuth).
[[nodiscard]] inline LongReal two_sum(Real l, Real r) noexcept {
  const Real sum = l + r;
  const Real part = sum - l;
  return {sum, (l - (sum - part)) + (r - part)};
}

/// l r exactly (Dekker), short of overflow and underflow.
[[nodiscard]] inline LongReal two_product(Real l, Real r) noexcept {
  constexpr Real kSplit = HAPTIC_REAL_IS_FLOAT ? 4097.0_r : 134217729.0_r;
  const Real lt = kSplit * l, rt = kSplit * r;
  const Real lh = lt - (lt - l), rh = rt - (rt - r);
  const Real ll = l - lh, rl = r - rh;
  const Real product = l * r;
  return {product, ((lh * rh - product) + lh * rl + ll * rh) + ll * rl};
}

[[nodiscard]] inline LongReal operator+(const LongReal& l, const LongReal& r) noexcept {
  const LongReal sum = two_sum(l.high, r.high);
  return two_sum(sum.high, sum.low + (l.low + r.low));
}
[[nodiscard]] inline LongReal operator-(const LongReal& r) noexcept { return {-r.high, -r.low}; }
[[nodiscard]] inline LongReal operator*(const LongReal& l, Real r) noexcept {
  const LongReal product = two_product(l.high, r);
  return two_sum(product.high, product.low + l.low * r);
}

/// a.(b x c), to about the square of Real's rounding. Cost: some 200 operations.
[[nodiscard]] inline LongReal long_determinant(const Vec3& a, const Vec3& b,
                                               const Vec3& c) noexcept {
  const auto minor = [&](int i, int j) {
    return two_product(b[i], c[j]) + -two_product(b[j], c[i]);
  };
  return (minor(1, 2) * a[0] + minor(2, 0) * a[1]) + minor(0, 1) * a[2];
}

}  // namespace haptic
