// SPDX-License-Identifier: Apache-2.0
// More pairs near the part than the list has slots for: nothing is crossed, free air is free, and
// what is pressed on comes free.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "rt_core/proxy/near_pairs.hpp"
#include "tests/support/proxy_bench.hpp"
#include "tests/support/random.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr bool kNearSingle = HAPTIC_REAL_IS_FLOAT;
/// Bars of a grating: more pairs than there are seats at least; and so many that there are more
/// pairs than slots.
constexpr int kBars = 20, kManyBars = 66;

/// Bars side by side, along x in the part and along y in the fixed one: the spheres round them
/// overlap from far away.
tools::Body bar_grating(int bars, bool along_x, double low_m, double high_m) {
  std::vector<tools::Body> pieces;
  for (int k = 0; k < bars; ++k) {
    const double at = -0.03 + 0.06 * k / bars, to = at + 0.04 / bars;
    pieces.push_back(along_x ? box({-0.03, at, low_m}, {0.03, to, high_m})
                             : box({at, -0.03, low_m}, {to, 0.03, high_m}));
  }
  return join(pieces);
}

tools::SceneDescription two_gratings(std::uint32_t near_pairs, int bars = kBars) {
  tools::SceneDescription description =
      proxy_scene_of(bar_grating(bars, true, -0.002, 0.002), {bar_grating(bars, false, -0.004, 0)});
  description.parameters.coupling.near_pairs = near_pairs;
  return description;
}

double pull_of(const StepResult& r) {
  return static_cast<double>(std::sqrt(r.wrench_w.force_w.squaredNorm()));
}

}  // namespace

TEST_SUITE("rt_core.near_pairs") {
  TEST_CASE("a scene of solids that lists its pairs has a slot for each; one with more says so") {
    const LoadedScene all(two_gratings(0)), few(two_gratings(16)), many(two_gratings(0, kManyBars));
    for (const LoadedScene* scene : {&all, &few}) {
      CHECK(scene->view.header().capacity.near_slots == kBars * kBars);
      CHECK((scene->view.header().capacity.unproven & kUnprovenNearPairs) == 0);
    }
    CHECK(few.view.header().capacity.state_bytes < all.view.header().capacity.state_bytes);
    CHECK(many.view.header().capacity.near_slots == kMaxNearPairs);
    CHECK((many.view.header().capacity.unproven & kUnprovenNearPairs) != 0);
    const LoadedScene asked(two_gratings(4356, kManyBars));
    CHECK(asked.view.header().capacity.near_slots == 4356);
    CHECK((asked.view.header().capacity.unproven & kUnprovenNearPairs) == 0);
  }

  TEST_CASE(
      "seats: so many as are asked for, but those that a pass needs, and none that are idle") {
    CHECK_FALSE(near_seats(1000, 0).take_turns);
    CHECK(near_seats(1000, 0).seats == 1000);
    CHECK(near_seats(1000, 300).take_turns);
    CHECK(near_seats(1000, 300).seats == 300);
    CHECK(near_seats(1000, 300).views == 300 + kGuestViews);
    CHECK(near_seats(1000, 1).seats == kLeastSeats);
    CHECK_FALSE(near_seats(kLeastSeats + kGuestViews, 1).take_turns);
    CHECK(near_seats(kLeastSeats + kGuestViews + 1, 1).take_turns);
  }

  TEST_CASE("free air is free with any number of seats and slots") {
    struct Choice {
      std::uint32_t near_pairs;
      int bars;
    };
    for (const Choice& c :
         {Choice{0, kBars}, Choice{300, kBars}, Choice{1, kBars}, Choice{0, kManyBars}}) {
      CAPTURE(c.near_pairs);
      CAPTURE(c.bars);
      LoadedScene scene(two_gratings(c.near_pairs, c.bars));
      static_cast<void>(scene.step({0, 0, 0.03}));
      double largest = 0;
      for (int k = 0; k <= 1000; ++k)
        largest = std::max(largest,
                           pull_of(scene.step({0.02 * std::sin(0.01 * k), 0, 0.03 - 2.5e-5 * k})));
      CHECK(largest < 0.001);
    }
  }

  TEST_CASE("pairs that take turns give the forces of pairs with a seat each") {
    ProxyBench all(two_gratings(0)), few(two_gratings(1));
    static_cast<void>(all.tick({0, 0, 0.01}));
    static_cast<void>(few.tick({0, 0, 0.01}));
    const double depth = (kNearSingle ? 4.0 : 1.01);
    double largest_m = 0, apart_m = 0;
    const auto go = [&](const Point& p, double turn_rad) {
      const std::array<double, 4> q{1, turn_rad / 2, turn_rad / 3, turn_rad / 2};
      const ProxyTick of_all = all.tick(p, q), of_few = few.tick(p, q);
      CHECK_FALSE(of_few.crowded);
      const double gap = static_cast<double>(few.distance_m(few.proxy.pose()));
      CHECK(gap >= -depth * static_cast<double>(few.parameters.scale.tolerance_m));
      const Vec3 difference_m = of_all.error.translation_m - of_few.error.translation_m;
      apart_m = std::max(apart_m, static_cast<double>(difference_m.norm()));
      largest_m = std::max(largest_m, static_cast<double>(of_all.error.translation_m.norm()));
    };
    for (int k = 0; k <= 200; ++k) go({0, 0, 0.01 - 5.0e-5 * k}, 0);  // 2 mm deep
    for (int k = 0; k <= 200; ++k) go({0.01 * k / 200, 0.004 * k / 200, 0}, 0.05 * k / 200);
    for (int k = 0; k <= 200; ++k) go({0.01, 0.004, 5.0e-5 * k}, 0.05 - 0.05 * k / 200);
    for (int k = 0; k < 20; ++k) go({0.01, 0.004, 0.01}, 0);
    CHECK(largest_m > 1.9e-3);
    CHECK(apart_m < 20 * static_cast<double>(few.parameters.scale.tolerance_m));
    CHECK(few.tick({0.01, 0.004, 0.01}).error.translation_m.norm() < 1e-9_r);
  }

  TEST_CASE("pairs that take turns: a start inside is led out") {
    for (const std::uint32_t near_pairs : {0u, 1u}) {
      CAPTURE(near_pairs);
      ProxyBench bench(two_gratings(near_pairs));
      CHECK(bench.tick({0, 0, 0}).recovering);  // 2 mm deep
      ProxyTick last;
      for (int k = 0; k < 400; ++k) last = bench.tick({0.002 * std::sin(0.1 * k), 0, 0});
      CHECK_FALSE(last.recovering);
      const double depth = (kNearSingle ? 4.0 : 1.01);
      const double gap = static_cast<double>(bench.distance_m(bench.proxy.pose()));
      CHECK(gap >= -depth * static_cast<double>(bench.parameters.scale.tolerance_m));
    }
  }

  TEST_CASE("pressed on more pairs than there are slots for, it enters none and comes free") {
    const double depth = (kNearSingle ? 4.0 : 1.01);
    ProxyBench bench(two_gratings(0, kManyBars));
    static_cast<void>(bench.tick({0, 0, 0.01}));
    bool crowded = false;
    int asked = 0;
    double largest_n = 0;
    const auto go = [&](const Point& p) {
      const ProxyTick tick = bench.tick(p);
      crowded = crowded || tick.crowded;
      if (++asked % 20 == 0) {
        const double gap = static_cast<double>(bench.distance_m(bench.proxy.pose()));
        CHECK(gap >= -depth * static_cast<double>(bench.parameters.scale.tolerance_m));
      }
      largest_n = std::max(
          largest_n, 1000 * std::sqrt(static_cast<double>(tick.error.translation_m.squaredNorm())));
    };
    for (int k = 0; k <= 200; ++k) go({0, 0, 0.01 - 5.0e-5 * k});  // 2 mm deep
    for (int k = 0; k <= 200; ++k) go({0.01 * k / 200, 0.004 * k / 200, 0});
    CHECK(largest_n > 1.9);
    for (int k = 0; k <= 200; ++k) go({0.01, 0.004, 5.0e-5 * k});
    for (int k = 0; k < 200; ++k) go({0.01, 0.004, 0.01});
    CHECK(crowded);
    largest_n = 0;
    go({0.01, 0.004, 0.01});
    CHECK(largest_n < 1e-6);
  }

  TEST_CASE("what a motion takes from a group is no less than from any of its pairs") {
    Random random(11);
    const auto vector = [&](double size) {
      return Vec3(static_cast<Real>(random.uniform(-size, size)),
                  static_cast<Real>(random.uniform(-size, size)),
                  static_cast<Real>(random.uniform(-size, size)));
    };
    int more = 0, later = 0;
    for (int k = 0; k < 20000; ++k) {
      LeftOut left;
      left.normal_w = vector(1).normalized();
      const Vec3 other_w = (left.normal_w + vector(0.2)).normalized();
      left.spread = (other_w - left.normal_w).cwiseAbs() * (1 + 4 * kRealEpsilon);
      const Vec3 lever = vector(0.02), dx = vector(0.002), dtheta = vector(0.3);
      left.reach_m = lever.norm() * (1 + 4 * kRealEpsilon);
      left.moment_m = (lever + vector(0.002)).cross(left.normal_w);
      left.moment_spread_m = (lever.cross(other_w) - left.moment_m).cwiseAbs() +
                             Vec3::Constant(4 * kRealEpsilon * left.reach_m);
      const auto taken_by = [&](const GripPose& from, const GripPose& to) {
        return -other_w.dot((to.r_wa - from.r_wa) * lever + to.x0_w - from.x0_w);
      };
      const GripPose start, there = moved(start, dx, dtheta);
      const Real taken = taken_by(start, there);
      CHECK(taken <= taken_m(left, dx, dtheta));
      LeftOut no_lever = left, no_moment = left;
      no_lever.spread = no_lever.moment_spread_m = Vec3::Zero();
      no_lever.reach_m = 0;
      more += taken > taken_m(no_lever, dx, dtheta) ? 1 : 0;
      // With another group beside it the bound holds too.
      LeftOut beside;
      beside.normal_w = vector(1).normalized();
      beside.spread = vector(0.1).cwiseAbs();
      CHECK(taken <= taken_m(joined(left, beside), dx, dtheta));
      // And of a second motion, after one that has turned the lever.
      const Vec3 next_dx = vector(0.002), next_dtheta = vector(0.3);
      const Real next = taken_by(there, moved(there, next_dx, next_dtheta));
      follow(left, dx, dtheta);
      CHECK(-left.gap_m >= taken);
      CHECK(next <= taken_m(left, next_dx, next_dtheta));
      no_moment.reach_m = left.reach_m;
      later += next > taken_m(no_moment, next_dx, next_dtheta) ? 1 : 0;
    }
    CHECK(later > 0);    // nor where the moments had stayed
    CHECK(more > 1000);  // without lever and spread the bound would not hold
  }
}
