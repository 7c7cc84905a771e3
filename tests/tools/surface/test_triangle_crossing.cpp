// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>

#include "tests/support/random.hpp"
#include "tools/graph_compiler/surface/triangle_crossing.hpp"

using namespace haptic::tools;
using haptic::test::Random;

namespace {

/// Whole numbers have exact products in 64-bit integers: an oracle without rounding.
int whole_side(const Point3& a, const Point3& b, const Point3& c, const Point3& d) {
  std::int64_t m[3][3];
  const Point3* rows[3] = {&a, &b, &c};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t k = 0; k < 3; ++k) m[r][k] = std::llround((*rows[r])[k] - d[k]);
  }
  const std::int64_t value = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                             m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                             m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  return value > 0 ? 1 : value < 0 ? -1 : 0;
}

constexpr TriangleCorners kFlat{{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}};

}  // namespace

TEST_SUITE("tools.triangle_crossing") {
  TEST_CASE("side_of_plane: right for points in and next to the plane") {
    Random random(11);
    int zeros = 0;
    for (int i = 0; i < 20000; ++i) {
      Point3 p[4];
      for (Point3& x : p) {
        for (double& value : x) value = std::floor(random.uniform(-4, 4));
      }
      const int expected = whole_side(p[0], p[1], p[2], p[3]);
      zeros += expected == 0 ? 1 : 0;
      CHECK(side_of_plane(p[0], p[1], p[2], p[3]) == expected);
      // Far from the origin, in steps of one rounding, doubles alone cannot tell.
      for (Point3& x : p) {
        for (double& value : x) value = 1.0 + value * 0x1p-52;
      }
      CHECK(side_of_plane(p[0], p[1], p[2], p[3]) == expected);
    }
    CHECK(zeros > 500);
    const Point3 a{0.1, 0.2, 0.3}, b{0.7, 0.1, 0.9}, c{0.4, 0.8, 0.5};
    CHECK(side_of_plane(a, b, c, c) == 0);
    Point3 above = c;
    above[2] = std::nextafter(above[2], 1.0);
    Point3 below = c;
    below[2] = std::nextafter(below[2], 0.0);
    CHECK(side_of_plane(a, b, c, above) * side_of_plane(a, b, c, below) == -1);
  }

  TEST_CASE("triangles that pass through each other cross, those that touch meet") {
    struct Case {
      const char* what;
      TriangleCorners other;
      bool crosses, meets;
    };
    const Case cases[] = {
        {"through", {{{1, 1, -1}, {1, 1, 1}, {9, 9, 0}}}, true, true},
        {"edge beside", {{{3, 3, -1}, {3, 3, 1}, {9, 9, 0}}}, false, false},
        {"corner on the inside", {{{1, 1, 0}, {1, 1, 1}, {9, 9, 1}}}, false, true},
        {"corner above", {{{1, 1, 1e-300}, {1, 1, 1}, {9, 9, 1}}}, false, false},
        {"corner on an edge", {{{2, 0, 0}, {2, -1, 1}, {2, -1, 2}}}, false, true},
        {"edges cross in the plane", {{{1, -1, 0}, {1, 1, 0}, {2, -1, 0}}}, false, true},
        {"one in the other", {{{0.5, 0.5, 0}, {1, 0.5, 0}, {0.5, 1, 0}}}, false, true},
        {"in the plane, apart", {{{5, 5, 0}, {6, 5, 0}, {5, 6, 0}}}, false, false},
        {"in the plane, boxes meet", {{{3, 3, 0}, {4, 3, 0}, {3, 4, 0}}}, false, false},
        {"parallel", {{{0, 0, 1e-12}, {4, 0, 1e-12}, {0, 4, 1e-12}}}, false, false},
        {"shared corner", {{{0, 0, 0}, {-1, 0, 1}, {-1, 0, 2}}}, false, true},
    };
    for (const Case& c : cases) {
      CAPTURE(c.what);
      CHECK(triangles_cross(kFlat, c.other) == c.crosses);
      CHECK(triangles_cross(c.other, kFlat) == c.crosses);
      CHECK(triangles_meet(kFlat, c.other) == c.meets);
      CHECK(triangles_meet(c.other, kFlat) == c.meets);
    }
  }

  TEST_CASE("exact_twice_area: the direction of a sliver is that of its plane") {
    // Height 1e-14 over a length of 1: the cross product in double keeps two digits.
    const double h = 0x1p-46;
    const Point3 sliver[3] = {{1, 1, 1}, {2, 2, 1}, {1.5, 1.5, 1 + h}};
    const Point3 n = exact_twice_area(sliver, 3);
    const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    CHECK(n[0] / length == doctest::Approx(std::sqrt(0.5)).epsilon(1e-15));
    CHECK(n[1] / length == doctest::Approx(-std::sqrt(0.5)).epsilon(1e-15));
    CHECK(std::abs(n[2] / length) < 1e-15);
  }
}
