// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "tests/support/manifold_oracle.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr Real kBand = 8 * kRealEpsilon;

/// A ConvexPolygon with memory of its own.
struct Ring {
  Ring(std::uint32_t corners, std::uint32_t cuts) {
    Arena counting;
    polygon.place(counting, corners, cuts);
    memory.resize(counting.used() / sizeof(std::max_align_t) + 1);
    Arena arena(reinterpret_cast<std::byte*>(memory.data()));
    polygon.place(arena, corners, cuts);
  }
  void load(const ExactPolygon& corners) {
    polygon.clear();
    for (const ExactPoint& p : corners)
      polygon.add({static_cast<Real>(p.x), static_cast<Real>(p.y)});
  }
  bool cut_by(const ExactPolygon& other) {
    for (std::size_t k = 0; k < other.size(); ++k) {
      const ExactPoint& p = other[k];
      const ExactPoint& q = other[(k + 1) % other.size()];
      if (!polygon.cut({static_cast<Real>(p.x), static_cast<Real>(p.y)},
                       {static_cast<Real>(q.x), static_cast<Real>(q.y)}, kBand)) {
        return false;
      }
    }
    return true;
  }
  [[nodiscard]] ExactPolygon corners() const {
    ExactPolygon list;
    std::uint16_t at = polygon.first();
    do {
      list.push_back({polygon.point(at).x, polygon.point(at).y});
      at = polygon.next(at);
    } while (at != polygon.first() && list.size() <= polygon.bound());
    return list;
  }
  std::vector<std::max_align_t> memory;
  ConvexPolygon polygon;
};

/// Corners as the core sees them: what the exact side works on is rounded first.
ExactPolygon ellipse(int n, double rx, double ry, double turn, double cx, double cy) {
  ExactPolygon corners;
  for (int k = 0; k < n; ++k) {
    const double angle = 2 * 3.14159265358979323846 * (k + 0.25) / n;
    const double x = rx * std::cos(angle), y = ry * std::sin(angle);
    const Real px = static_cast<Real>(cx + x * std::cos(turn) - y * std::sin(turn));
    const Real py = static_cast<Real>(cy + x * std::sin(turn) + y * std::cos(turn));
    corners.push_back({px, py});
  }
  return corners;
}

}  // namespace

TEST_SUITE("rt_core.convex_polygon") {
  TEST_CASE("cut by another polygon it is their intersection") {
    Random random(17);
    int whole = 0, empty = 0;
    const Exact slack = 400 * static_cast<Exact>(kRealEpsilon);
    for (int k = 0; k < 3000; ++k) {
      const int n = 3 + static_cast<int>(random.next() % 30);
      const int m = 3 + static_cast<int>(random.next() % 30);
      const bool thin = k % 4 == 0;
      const ExactPolygon p =
          ellipse(n, 1, thin ? 1e-3 : random.uniform(0.3, 1), random.uniform(0, 6), 0, 0);
      const ExactPolygon q =
          ellipse(m, random.uniform(0.2, 1.5), random.uniform(0.2, 1.5), random.uniform(0, 6),
                  random.uniform(-1.2, 1.2), random.uniform(-1.2, 1.2));
      CAPTURE(k);
      Ring ring(static_cast<std::uint32_t>(n), static_cast<std::uint32_t>(m));
      ring.load(p);
      const ExactPolygon expected = hull_of(intersection_of(p, q, 0));
      if (!ring.cut_by(q)) {
        ++empty;
        CHECK(area_of(expected) <= slack);
        continue;
      }
      const ExactPolygon corners = ring.corners();
      whole += area_of(corners) > 0 ? 1 : 0;
      CHECK(std::abs(area_of(corners) - area_of(expected)) < 10 * slack);
      for (const ExactPoint& c : corners) {
        CHECK(distance_from(p, c) <= slack);
        CHECK(distance_from(q, c) <= slack);
      }
    }
    CHECK(whole > 1500);
    CHECK(empty > 300);
  }

  TEST_CASE("cut by itself, by its turned or its touching image it stays sound") {
    for (const int n : {3, 4, 7, 64, 4096}) {
      const ExactPolygon p = ellipse(n, 1, 0.7, 0, 0, 0);
      const Exact slack = 1000 * static_cast<Exact>(kRealEpsilon);
      Ring ring(static_cast<std::uint32_t>(n), static_cast<std::uint32_t>(n));
      CAPTURE(n);
      for (const double turn : {0.0, 1e-17, 1e-15, 1e-12, 1e-9, 1e-7, 1e-4}) {
        CAPTURE(turn);
        const ExactPolygon q = ellipse(n, 1, 0.7, turn, 0, 0);
        ring.load(p);
        REQUIRE(ring.cut_by(q));
        const ExactPolygon corners = ring.corners();
        CHECK(corners.size() <= static_cast<std::size_t>(2 * n));
        CHECK(std::abs(area_of(corners) - area_of(p)) < 3 * static_cast<Exact>(turn) + slack);
        if (n < 100) {
          for (const ExactPoint& c : corners) {
            CHECK(distance_from(p, c) <= slack);
            CHECK(distance_from(q, c) <= slack);
          }
        }
      }
      // Moved until it touches at most: what is left has no area and no NaN.
      ring.load(p);
      if (ring.cut_by(ellipse(n, 1, 0.7, 0, 2, 0))) {
        for (const ExactPoint& c : ring.corners()) {
          CHECK(std::isfinite(c.x));
          CHECK(std::isfinite(c.y));
        }
        CHECK(std::abs(area_of(ring.corners())) < slack);
      }
      ring.load(p);
      CHECK_FALSE(ring.cut_by(ellipse(n, 1, 0.7, 0, 2.01, 0)));
    }
  }

  TEST_CASE("corners of one place and on one side are cut as one; removal") {
    Ring ring(6, 1);
    ring.load({{0, 0}, {1, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 1}});
    CHECK(ring.polygon.cut({0, 0.5_r}, {1, 0.5_r}, kBand));  // keeps the upper half
    ExactPolygon half = ring.corners();
    CHECK(std::abs(area_of(half) - 0.5L) < 10 * kBand);
    for (const ExactPoint& p : half) CHECK(p.y >= 0.5L - kBand);
    ring.load({{0, 0}, {1, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 1}});
    ring.polygon.remove(1);
    CHECK(ring.corners().size() == 5);
    CHECK(ring.polygon.next(0) == 2);
  }
}
