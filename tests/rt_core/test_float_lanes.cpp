// SPDX-License-Identifier: Apache-2.0
// Eight numbers at a time: the same bits in registers as one after the other.
#include <doctest/doctest.h>

#include <bit>
#include <cmath>

#include "rt_core/base/float_lanes.hpp"
#include "tests/support/random.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr std::uint32_t kTrials = 2000;

struct alignas(16) Eight {
  float x[kFloatLanes];
};

/// Numbers of all sizes, some of them equal to those of `other`, some zero of either sign.
Eight numbers(Random& random, const Eight& other) {
  Eight out;
  for (std::uint32_t k = 0; k < kFloatLanes; ++k) {
    const double kind = random.uniform(0, 1);
    const double size = std::pow(10.0, random.uniform(-12, 6));
    out.x[k] = kind < 0.1   ? other.x[k]
               : kind < 0.2 ? std::copysign(0.0f, static_cast<float>(random.uniform(-1, 1)))
                            : static_cast<float>(size * random.uniform(-1, 1));
  }
  return out;
}

bool same_bits(const Eight& l, const Eight& r) {
  for (std::uint32_t k = 0; k < kFloatLanes; ++k) {
    if (std::bit_cast<std::uint32_t>(l.x[k]) != std::bit_cast<std::uint32_t>(r.x[k])) return false;
  }
  return true;
}

/// What an operation makes of two lists, by this machine's lanes and one number after the other.
template <typename Operation>
bool agrees(const Eight& a, const Eight& b, const Operation& operation) {
  Eight wide, each;
  store_floats(operation(load_floats(a.x), load_floats(b.x)), wide.x);
  each_lane::store_floats(operation(each_lane::load_floats(a.x), each_lane::load_floats(b.x)),
                          each.x);
  return same_bits(wide, each);
}

}  // namespace

TEST_SUITE("rt_core.float_lanes") {
  TEST_CASE("every operation has the bits of one number after the other") {
    Random random(7);
    Eight a{}, b{};
    for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
      a = numbers(random, b);
      b = numbers(random, a);
      CHECK(agrees(a, b, [](const auto& l, const auto& r) { return l + r; }));
      CHECK(agrees(a, b, [](const auto& l, const auto& r) { return l - r; }));
      CHECK(agrees(a, b, [](const auto& l, const auto& r) { return l * r; }));
      CHECK(agrees(a, b, [](const auto& l, const auto& r) { return smaller(l, r); }));
      CHECK(agrees(a, b, [](const auto& l, const auto& r) { return larger(l, r); }));
      CHECK(agrees(a, b, [](const auto& l, const auto& r) { return where_below(l, r, r, l); }));
      CHECK(agrees(a, b, [](const auto& l, const auto& r) { return (l * r + l) * r - r; }));
      CHECK(lanes_below(load_floats(a.x), load_floats(b.x)) ==
            each_lane::lanes_below(each_lane::load_floats(a.x), each_lane::load_floats(b.x)));
    }
  }

  TEST_CASE("bounds are rounded to their side of the number") {
    Random random(8);
    for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
      const double x = std::pow(10.0, random.uniform(-12, 6)) * random.uniform(-1, 1);
      CHECK(static_cast<double>(rounded_down(x)) <= x);
      CHECK(static_cast<double>(rounded_up(x)) >= x);
    }
    CHECK(rounded_down(0.0) == 0.0f);
  }

  TEST_CASE("the least lane is the smallest number") {
    Eight a{{3, 1, 4, 1.5f, 9, 2, 6, 5}};
    for (std::uint32_t k = 0; k < kFloatLanes; ++k) {
      Eight b = a;
      b.x[k] = -1;
      CHECK(least_lane(load_floats(b.x)) == -1.0f);
    }
  }
}
