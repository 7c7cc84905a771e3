// SPDX-License-Identifier: Apache-2.0
// The weighted contact region on contacts whose numbers can be derived by hand, and against a brute
// force over all sides and triangles of the points.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "rt_core/law/weighted_region_law.hpp"
#include "tests/support/shapes.hpp"

using namespace haptic;
using haptic::test::Random;

namespace {

constexpr Real kRegionStiffness_n_per_m = 1000, kRegionDepth_m = -0.001_r, kRegionSize_m = 0.2_r;
constexpr double kRegionTolerance = HAPTIC_REAL_IS_FLOAT ? 1e-6 : 1e-14;  // N, N m
const Vec3 kUp(0, 0, 1);

Wrench wrench_of(std::span<const WeightedContact> contacts) {
  std::vector<PlanePoint> points(contacts.size()), hull(2 * contacts.size());
  return weighted_region_wrench(contacts, kRegionDepth_m, kRegionStiffness_n_per_m, kRegionSize_m,
                                {points, hull});
}

/// Contacts of full weight in the plane z = -0.05 below x_0^A.
std::vector<WeightedContact> flat(const std::vector<std::array<double, 2>>& points) {
  std::vector<WeightedContact> contacts;
  for (const auto& p : points) {
    contacts.push_back({kUp, Vec3(static_cast<Real>(p[0]), static_cast<Real>(p[1]), -0.05_r), 1});
  }
  return contacts;
}

void check_region_vector(const Vec3& got, double x, double y, double z) {
  CHECK(std::abs(static_cast<double>(got[0]) - x) <= kRegionTolerance);
  CHECK(std::abs(static_cast<double>(got[1]) - y) <= kRegionTolerance);
  CHECK(std::abs(static_cast<double>(got[2]) - z) <= kRegionTolerance);
}

using Wide2 = std::array<long double, 2>;

/// Distance of the origin from the hull by trying every pair of points and every triangle.
long double brute_distance(const std::vector<PlanePoint>& points) {
  std::vector<Wide2> p;
  for (const PlanePoint& q : points) {
    p.push_back({static_cast<long double>(q.x), static_cast<long double>(q.y)});
  }
  const auto cross_of = [](const Wide2& l, const Wide2& r) { return l[0] * r[1] - l[1] * r[0]; };
  long double best = HUGE_VALL;
  for (std::size_t i = 0; i < p.size(); ++i) {
    best = std::min(best, std::hypot(p[i][0], p[i][1]));
    for (std::size_t j = i + 1; j < p.size(); ++j) {
      const Wide2 d = {p[j][0] - p[i][0], p[j][1] - p[i][1]};
      const long double length2 = d[0] * d[0] + d[1] * d[1];
      if (length2 == 0) continue;
      const long double t = std::clamp(-(p[i][0] * d[0] + p[i][1] * d[1]) / length2, 0.0L, 1.0L);
      best = std::min(best, std::hypot(p[i][0] + t * d[0], p[i][1] + t * d[1]));
      for (std::size_t k = j + 1; k < p.size(); ++k) {
        const long double s[3] = {cross_of(p[i], p[j]), cross_of(p[j], p[k]), cross_of(p[k], p[i])};
        const bool in = (s[0] > 0 && s[1] > 0 && s[2] > 0) || (s[0] < 0 && s[1] < 0 && s[2] < 0);
        if (in) return 0;
      }
    }
  }
  return best;
}

/// A set of points of the kinds that contact regions have: scattered, on a line, on a grid, on a
/// circle, with duplicates, at all scales of distance from the origin.
std::vector<PlanePoint> random_points(Random& random, int largest) {
  const auto count = 1 + random.next() % static_cast<std::uint64_t>(largest);
  const auto kind = random.next() % 5;
  const double spread = std::pow(10.0, random.uniform(-7, -1));
  const double cx = random.uniform(-1, 1) * std::pow(10.0, random.uniform(-9, -1));
  const double cy = random.uniform(-1, 1) * std::pow(10.0, random.uniform(-9, -1));
  const double angle = random.uniform(0, 6.3);
  std::vector<PlanePoint> points;
  for (std::uint64_t k = 0; k < count; ++k) {
    double x = random.uniform(-1, 1), y = random.uniform(-1, 1);
    if (kind == 1) {  // on a line
      y = x * std::sin(angle);
      x *= std::cos(angle);
    } else if (kind == 2) {  // on a grid
      x = std::round(2 * x);
      y = std::round(2 * y);
    } else if (kind == 3) {  // on a circle
      x = std::cos(3.1 * x + angle);
      y = std::sqrt(1 - x * x) * (y < 0 ? -1 : 1);
    }
    points.push_back({static_cast<Real>(cx + spread * x), static_cast<Real>(cy + spread * y)});
    if (kind == 4 && random.next() % 2 == 0)
      points.push_back(points[random.next() % points.size()]);
  }
  return points;
}

}  // namespace

TEST_SUITE("rt_core.weighted_region_law") {
  TEST_CASE("weight: falls linearly with depth, violation and distance from the features") {
    const Real eps = 0.0005_r, eps_o = 0.0001_r, d = -0.001_r;
    const auto weight = [&](Real f, Real violation, Real outside) {
      return static_cast<double>(contact_weight(f, d, violation, outside, eps, eps_o));
    };
    const double tolerance = HAPTIC_REAL_IS_FLOAT ? 1e-6 : 1e-12;
    CHECK(weight(d, 0, 0) == 1);
    CHECK(weight(d, -0.03_r, 0) == 1);  // applicable beyond doubt
    CHECK(std::abs(weight(d - eps / 4, -0.03_r, 0) - 0.75) < tolerance);
    CHECK(std::abs(weight(d + eps / 4, 0, 0) - 0.75) < tolerance);  // a rejected node above D
    CHECK(std::abs(weight(d, eps / 2, 0) - 0.5) < tolerance);
    CHECK(std::abs(weight(d - eps / 4, eps / 2, eps_o / 2) - 0.125) < tolerance);
    CHECK(weight(d - eps, 0, 0) < tolerance);
    CHECK(weight(d - 2 * eps, 0, 0) == 0);
    CHECK(weight(d, 2 * eps, 0) == 0);
    CHECK(weight(d, 0, 2 * eps_o) == 0);
  }

  TEST_CASE("one contact: eqs. (2) and (3), regardless of its weight") {
    for (const Real weight : {1.0_r, 0.25_r}) {
      const WeightedContact contact{Vec3(0.6_r, 0, 0.8_r), Vec3(0.03_r, -0.01_r, -0.04_r), weight};
      const Wrench w = wrench_of({&contact, 1});
      check_region_vector(w.force_w, 0.6, 0, 0.8);
      check_region_vector(w.torque_w, -0.01 * 0.8, -0.04 * 0.6 - 0.03 * 0.8, 0.01 * 0.6);
    }
  }

  TEST_CASE("edge-face with pi between the ends: eqs. (5) and (6)") {
    // The edge along x at y = 0.02; the signs of tau_y differ, so only the lever across counts.
    const Wrench w = wrench_of(flat({{0.03, 0.02}, {-0.02, 0.02}}));
    check_region_vector(w.force_w, 0, 0, 1);
    check_region_vector(w.torque_w, 0.02, 0, 0);
  }

  TEST_CASE("edge-face with pi beyond an end: the nearest point of the edge") {
    const Wrench w = wrench_of(flat({{0.03, 0.02}, {0.01, 0.02}}));
    check_region_vector(w.torque_w, 0.02, -0.01, 0);
  }

  TEST_CASE("face-face: no torque with pi in H, the nearest side or corner outside") {
    const std::vector<std::array<double, 2>> square = {
        {-0.03, -0.02}, {0.05, -0.02}, {0.05, 0.04}, {-0.03, 0.04}};
    check_region_vector(wrench_of(flat(square)).torque_w, 0, 0, 0);
    const auto moved = [&](double dx, double dy) {
      std::vector<std::array<double, 2>> points = square;
      for (auto& p : points) p = {p[0] + dx, p[1] + dy};
      return wrench_of(flat(points));
    };
    check_region_vector(moved(0.04, 0).torque_w, 0, -0.01, 0);        // x from 0.01 on
    check_region_vector(moved(0, -0.05).torque_w, -0.01, 0, 0);       // y up to -0.01
    check_region_vector(moved(0.04, 0.03).torque_w, 0.01, -0.01, 0);  // corner (0.01, 0.01)
    check_region_vector(moved(0.03, 0).torque_w, 0, 0, 0);            // pi on the side itself
    check_region_vector(moved(0.03, 0.02).torque_w, 0, 0, 0);         // and on the corner
  }

  TEST_CASE("a contact of weight w draws its point from the mean by w") {
    std::vector<WeightedContact> contacts = flat({{0.02, 0.01}, {0.06, 0.01}});
    contacts[0].weight = 0.5_r;
    // c = (0.5 0.02 + 0.06)/1.5 = 0.14/3; q_0 = c + 0.5 (0.02 - c) = 0.01 + 0.07/3, q_1 = 0.06.
    check_region_vector(wrench_of(contacts).torque_w, 0.01, -(0.01 + 0.07 / 3), 0);
    contacts[0].weight = 0;
    check_region_vector(wrench_of(contacts).torque_w, 0.01, -0.06, 0);
  }

  TEST_CASE("two sides of a thin plate cancel; two planes share the force") {
    const Vec3 app(0.03_r, 0.01_r, 0.02_r);
    const std::array<WeightedContact, 2> plate = {WeightedContact{kUp, app, 1},
                                                  WeightedContact{-kUp, app, 1}};
    check_region_vector(wrench_of(plate).force_w, 0, 0, 0);
    check_region_vector(wrench_of(plate).torque_w, 0, 0, 0);
    const Vec3 tilted = Vec3(0.48_r, 0.6_r, 0.64_r);
    const std::array<WeightedContact, 3> three = {WeightedContact{tilted, app, 0.5_r},
                                                  WeightedContact{-tilted, app, 0.25_r},
                                                  WeightedContact{-tilted, -app, 0.25_r}};
    const Wrench cancelled = wrench_of(three);
    CHECK(cancelled.force_w.squaredNorm() == 0);
    CHECK(cancelled.torque_w.squaredNorm() == 0);
    const std::array<WeightedContact, 2> partly = {WeightedContact{kUp, app, 1},
                                                   WeightedContact{-kUp, app, 0.5_r}};
    check_region_vector(wrench_of(partly).force_w, 0, 0, 1.0 / 3);
    const std::array<WeightedContact, 2> corner = {
        WeightedContact{kUp, Vec3(-0.04_r, 0, -0.05_r), 1},
        WeightedContact{Vec3(1, 0, 0), Vec3(-0.05_r, 0, -0.04_r), 1}};
    check_region_vector(wrench_of(corner).force_w, 0.5, 0, 0.5);
    // Projected along (1, 0, 1): (0.005, 0, -0.005) and its opposite, with 0 between them.
    check_region_vector(wrench_of(corner).torque_w, 0, 0, 0);
  }

  TEST_CASE("no contact, or none with weight: zero wrench") {
    CHECK(wrench_of({}).force_w.squaredNorm() == 0);
    std::vector<WeightedContact> contacts = flat({{0.02, 0.01}, {0.06, 0.01}});
    for (WeightedContact& c : contacts) c.weight = 0;
    CHECK(wrench_of(contacts).force_w.squaredNorm() == 0);
    CHECK(wrench_of(contacts).torque_w.squaredNorm() == 0);
  }

  TEST_CASE("duplicates and points on one line change nothing") {
    const Wrench once = wrench_of(flat({{0.01, 0.02}, {0.05, 0.04}}));
    const Wrench more = wrench_of(flat(
        {{0.05, 0.04}, {0.01, 0.02}, {0.03, 0.03}, {0.05, 0.04}, {0.01, 0.02}, {0.02, 0.025}}));
    CHECK((once.torque_w - more.torque_w).norm() < 1e-7_r);
    const Wrench same = wrench_of(flat({{0.01, 0.02}, {0.01, 0.02}, {0.01, 0.02}}));
    check_region_vector(same.torque_w, 0.02, -0.01, 0);
    // On a line through pi: beyond an end, and across it.
    check_region_vector(wrench_of(flat({{0.04, 0}, {0.01, 0}, {0.02, 0}})).torque_w, 0, -0.01, 0);
    check_region_vector(wrench_of(flat({{0.04, 0}, {-0.01, 0}, {0.02, 0}})).torque_w, 0, 0, 0);
  }

  TEST_CASE("closest point of the hull agrees with a brute force over all sides and triangles") {
    constexpr std::uint64_t kSeed = 20261121;
    CAPTURE(kSeed);
    Random random(kSeed);
    const long double rounding = static_cast<long double>(kRealEpsilon);
    for (int run = 0; run < 100000; ++run) {
      const std::vector<PlanePoint> points = random_points(random, run % 100 == 0 ? 40 : 9);
      long double extent = 0;
      for (const PlanePoint& p : points) {
        extent = std::max(extent, static_cast<long double>(norm(p)));
      }
      const auto width = static_cast<Real>(4 * rounding * extent);
      const PlanePoint got = closest_of_hull(points, width);
      const auto distance =
          std::hypot(static_cast<long double>(got.x), static_cast<long double>(got.y));
      const long double wanted = brute_distance(points);
      CAPTURE(run);
      REQUIRE(std::abs(distance - wanted) <= 16 * rounding * extent);
      if (distance <= static_cast<long double>(width)) continue;
      // No point lies nearer along the direction of the answer (known to rounding over distance),
      // so it is the answer: the length alone would let a point pass that turns about the origin.
      for (const PlanePoint& p : points) {
        const long double along =
            (static_cast<long double>(p.x) * static_cast<long double>(got.x) +
             static_cast<long double>(p.y) * static_cast<long double>(got.y)) /
            distance;
        REQUIRE(along >= distance - 32 * rounding * extent * (1 + extent / distance));
      }
    }
  }

  TEST_CASE("a hundred points on an arc about pi, the longest way round, are found") {
    for (const double radius : {0.1, 0.001}) {
      for (int shift = 0; shift < 50; ++shift) {
        std::vector<PlanePoint> points;
        for (int k = 0; k < 100; ++k) {
          const double t = -1.5 + 3.0 * ((k * 37 + shift) % 100) / 99.0;
          // Concave side towards pi: every point is a vertex of the chain that pi sees.
          points.push_back({static_cast<Real>(0.2 - radius * std::cos(t)),
                            static_cast<Real>(0.0007 * shift + radius * std::sin(t))});
        }
        const PlanePoint got = closest_of_hull(points, 1e-12_r);
        const auto distance = static_cast<double>(norm(got));
        CHECK(std::abs(distance - static_cast<double>(brute_distance(points))) <
              64 * static_cast<double>(kRealEpsilon));
      }
    }
  }

  TEST_CASE("the wrench follows weights, points and normals without a jump") {
    constexpr std::uint64_t kSeed = 7;
    CAPTURE(kSeed);
    Random random(kSeed);
    const auto coordinate = [&](double width) {
      return static_cast<Real>(random.uniform(-width, width));
    };
    for (int run = 0; run < 20000; ++run) {
      CAPTURE(run);
      std::vector<WeightedContact> before;
      const auto count = 2 + random.next() % 8;
      for (std::uint64_t k = 0; k < count; ++k) {
        const Vec3 n = Vec3(coordinate(0.1), coordinate(0.1), 1).normalized();
        const Real weight = std::clamp(static_cast<Real>(random.uniform(-0.3, 1.3)), 0_r, 1_r);
        before.push_back({n, Vec3(coordinate(0.05), coordinate(0.05), -0.05_r), weight});
      }
      before[0].weight = 1;  // the nearest C-face
      std::vector<WeightedContact> after = before;
      const Real step = HAPTIC_REAL_IS_FLOAT ? 1e-4_r : 1e-7_r;
      for (WeightedContact& c : after) {
        if (&c != &after[0]) c.weight = std::clamp(c.weight + coordinate(1) * step, 0_r, 1_r);
        c.app_w += step * 0.1_r * Vec3(coordinate(1), coordinate(1), coordinate(1));
        c.normal_w = (c.normal_w + step * Vec3(coordinate(1), coordinate(1), 0)).normalized();
      }
      const Wrench l = wrench_of(before), r = wrench_of(after);
      // |F| is 1 N and no lever exceeds 0.1 m: each change enters with a factor of that order.
      CHECK((l.force_w - r.force_w).norm() < 10 * step);
      CHECK((l.torque_w - r.torque_w).norm() < 2 * step);
    }
  }
}
