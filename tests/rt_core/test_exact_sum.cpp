// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>

#include "rt_core/base/exact_sum.hpp"

using namespace haptic;

TEST_SUITE("rt_core.exact_sum") {
  TEST_CASE("sums and products lose nothing") {
    const LongReal sum = two_sum(1.0_r, kRealEpsilon / 8);
    CHECK(sum.high == 1);
    CHECK(sum.low == kRealEpsilon / 8);
    const Real x = 1 + kRealEpsilon;
    const LongReal square = two_product(x, x);  // 1 + 2 u + u^2
    CHECK(square.high == 1 + 2 * kRealEpsilon);
    CHECK(square.low == kRealEpsilon * kRealEpsilon);
  }

  TEST_CASE("the determinant keeps its sign where plain products lose it") {
    // Columns (1 + u, 1, 1), (1, 1 - u, 1), (1, 1, 1): the determinant is -u^2.
    const Real u = kRealEpsilon;
    const Vec3 a(1 + u, 1, 1), b(1, 1 - u, 1), c(1, 1, 1);
    CHECK(long_determinant(a, b, c).high == -u * u);
    CHECK(long_determinant(b, a, c).high == u * u);
    const Vec3 d(1, 2, 3), e(4, 5, 6), f(7, 8, 10);
    CHECK(long_determinant(d, e, f).high == -3);
    CHECK(long_determinant(d, e, d + e).high == 0);
  }
}
