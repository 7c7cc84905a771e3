// SPDX-License-Identifier: Apache-2.0
/// Exact arithmetic of one body: conversions, predicates and tables.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/tools/polyhedron/solid_builder.hpp"

namespace haptic::tools {
namespace {

using test::TestRandom;

Rational fraction(long n, long d) { return Rational(Integer(n), Integer(d)); }

// Is `value` the double nearest to v / sqrt(square)? Checked by squares of the midpoints to both
// neighbours.
bool nearest_over_root(double value, const Rational& v, const Rational& square) {
  const Rational target = v * v / square;
  const Rational magnitude(std::abs(value));
  const Rational up(std::nextafter(std::abs(value), 1.0e300));
  const Rational down(std::nextafter(std::abs(value), 0.0));
  const Rational high = (magnitude + up) / 2;
  const Rational low = (magnitude + down) / 2;
  return low * low <= target && target <= high * high && (value < 0) == (v < 0);
}

TEST_SUITE("tools.exact") {
  TEST_CASE("to_double: quotients round like the processor's division") {
    TestRandom random(1);
    for (int i = 0; i < 20000; ++i) {
      const long n = random.between(-1'000'000'000'000, 1'000'000'000'000);
      const long d = random.between(1, 1'000'000'000);
      REQUIRE(to_double(fraction(n, d)) == static_cast<double>(n) / static_cast<double>(d));
    }
  }

  TEST_CASE("to_double: doubles come back unchanged, ties go to even") {
    for (const double x : {0.0, 1.0, -1.0, 0.1, 1.0e-300, -7.25e200, 0x1.fffffffffffffp-3}) {
      CHECK(to_double(Rational(x)) == x);
    }
    const Rational half_ulp = Rational(std::ldexp(1.0, -53));
    CHECK(to_double(Rational(1) + half_ulp) == 1.0);
    CHECK(to_double(Rational(1) + 3 * half_ulp) == 1.0 + std::ldexp(1.0, -51));
    CHECK(to_double(Rational(1) + half_ulp + half_ulp / 1000000) == std::nextafter(1.0, 2.0));
  }

  TEST_CASE("over_root: unit normals and offsets are rounded once") {
    TestRandom random(2);
    for (int i = 0; i < 2000; ++i) {
      const Rational v = fraction(random.between(-100000, 100000), random.between(1, 1000));
      const Rational square = fraction(random.between(1, 1000000), random.between(1, 1000));
      if (v == 0) continue;
      REQUIRE(nearest_over_root(over_root(v, square), v, square));
    }
    CHECK(over_root(Rational(-3), Rational(9)) == -1.0);
    CHECK(over_root(Rational(0), Rational(9)) == 0.0);
  }

  TEST_CASE("side: exact where the filter cannot decide") {
    ExactWorld world;
    // Points a hair above, on and below a plane: differences far below one rounding.
    const Rational hair = Rational(std::ldexp(1.0, -200));
    const std::uint32_t plane =
        world.add_plane({fraction(1, 3), fraction(1, 7), fraction(1, 11)}, Rational(1));
    const Rational3 on{Rational(1), Rational(2),
                       (Rational(1) - fraction(1, 3) - fraction(2, 7)) * 11};
    Rational3 above = on;
    above[0] += hair;
    Rational3 below = on;
    below[0] -= hair;
    CHECK(world.side(world.find_or_add_vertex(on), plane) == 0);
    CHECK(world.side(world.find_or_add_vertex(above), plane) == 1);
    CHECK(world.side(world.find_or_add_vertex(below), plane) == -1);
    // Again, now from the memory of exact signs.
    CHECK(world.side(0, plane) == 0);
  }

  TEST_CASE("turn: sign of the triple product, exact for nearly parallel planes") {
    ExactWorld world;
    const Rational hair = Rational(std::ldexp(1.0, -150));
    const std::uint32_t p = world.add_plane({Rational(1), Rational(0), Rational(0)}, Rational(0));
    const std::uint32_t q = world.add_plane({Rational(1), hair, Rational(0)}, Rational(0));
    const std::uint32_t u = world.find_or_add_vertex({Rational(0), Rational(0), Rational(0)});
    const std::uint32_t v = world.find_or_add_vertex({Rational(0), Rational(0), Rational(1)});
    const std::uint32_t w = world.find_or_add_vertex({Rational(0), Rational(1), Rational(0)});
    CHECK(world.turn(p, q, u, v) == 1);
    CHECK(world.turn(q, p, u, v) == -1);
    CHECK(world.turn(p, q, v, u) == -1);
    CHECK(world.turn(p, q, u, w) == 0);
  }

  TEST_CASE(
      "tables: equal planes and points have equal indices, regardless of their scale and sign") {
    ExactWorld world;
    int sign = 0;
    const std::uint32_t a =
        world.find_or_add_plane({Rational(0), Rational(2), Rational(-3)}, Rational(5), sign);
    CHECK(sign == 1);
    CHECK(world.find_or_add_plane({Rational(0), fraction(-2, 7), fraction(3, 7)}, fraction(-5, 7),
                                  sign) == a);
    CHECK(sign == -1);
    CHECK(world.find_or_add_plane({Rational(0), Rational(4), Rational(-6)}, Rational(10), sign) ==
          a);
    CHECK(sign == 1);
    CHECK(world.find_or_add_plane({Rational(0), Rational(4), Rational(-6)}, Rational(11), sign) !=
          a);
    const std::uint32_t v = world.find_or_add_vertex({fraction(2, 6), Rational(0), Rational(1)});
    CHECK(world.find_or_add_vertex({fraction(1, 3), Rational(0), Rational(1)}) == v);
    CHECK(world.find_or_add_vertex(
              {fraction(1, 3) + Rational(std::ldexp(1.0, -100)), Rational(0), Rational(1)}) != v);
  }

  TEST_CASE("cut_edge: the point lies on the plane exactly and is made once") {
    ExactWorld world;
    const std::uint32_t u = world.find_or_add_vertex({fraction(1, 3), fraction(1, 7), Rational(0)});
    const std::uint32_t v = world.find_or_add_vertex({fraction(5, 3), fraction(9, 7), Rational(2)});
    const std::uint32_t p = world.add_plane({Rational(3), Rational(5), Rational(7)}, Rational(11));
    REQUIRE(world.side(u, p) * world.side(v, p) < 0);
    const std::uint32_t c = world.cut_edge(u, v, p);
    CHECK(world.side(c, p) == 0);
    CHECK(world.cut_edge(v, u, p) == c);
    const Rational3 e = subtract(world.vertices[v].x, world.vertices[u].x);
    const Rational3 d = subtract(world.vertices[c].x, world.vertices[u].x);
    for (const Rational& x : cross(e, d)) CHECK(x == 0);
  }

  TEST_CASE("work: the limit stops with its own exception, and so do too many bits") {
    ExactWorld world;
    world.work_limit = 1000.0;
    CHECK_THROWS_AS(
        [&] {
          for (long i = 0; i < 100; ++i) {
            world.find_or_add_vertex({Rational(i), Rational(0), Rational(0)});
          }
        }(),
        WorkLimitReached);
    ExactWorld narrow;
    narrow.max_coordinate_bits = 100;
    const Rational hair = Rational(std::ldexp(1.0, -200));
    CHECK_THROWS_AS(narrow.find_or_add_vertex({hair, Rational(0), Rational(0)}), WorkLimitReached);
  }
}

}  // namespace
}  // namespace haptic::tools
