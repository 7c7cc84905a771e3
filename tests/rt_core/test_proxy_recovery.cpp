// SPDX-License-Identifier: Apache-2.0
// A part that is put inside fixed parts is led out of their union, across the seams between them.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/support/proxy_bench.hpp"
#include "tests/support/random.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

/// 27 flush cubes of 20 mm in a block of 60 mm, each a part of its own.
std::vector<tools::Body> flush_cubes() {
  std::vector<tools::Body> cubes;
  for (int k = 0; k < 27; ++k) {
    const Point lo{-0.03 + 0.02 * (k % 3), -0.03 + 0.02 * (k / 3 % 3), -0.03 + 0.02 * (k / 9)};
    cubes.push_back(box(lo, {lo[0] + 0.02, lo[1] + 0.02, lo[2] + 0.02}));
  }
  return cubes;
}

/// Hulls that overlap each other, in one cluster.
std::vector<tools::Body> overlapping_hulls() {
  Random random(7);
  std::vector<tools::Body> bodies;
  for (std::uint64_t k = 0; k < 12; ++k) {
    const double x = random.uniform(-0.02, 0.02), y = random.uniform(-0.02, 0.02);
    const double z = random.uniform(-0.02, 0.02);
    bodies.push_back(box({x - 0.015, y - 0.012, z - 0.01}, {x + 0.012, y + 0.015, z + 0.014}));
  }
  return bodies;
}

tools::Body led_part() { return box({-0.006, -0.005, -0.004}, {0.006, 0.005, 0.004}); }

/// Ticks until it is free, the goal inside for ever.
int ticks_until_free(const tools::SceneDescription& description, const Point& p,
                     const std::array<double, 4>& q, int most) {
  ProxyBench bench(description);
  for (int ticks = 1; ticks <= most; ++ticks) {
    const ProxyTick tick = bench.tick(p, q);
    if (tick.recovering) continue;
    const double tolerance_m = static_cast<double>(bench.parameters.scale.tolerance_m);
    CHECK(static_cast<double>(bench.distance_m(bench.proxy.pose())) >= -4 * tolerance_m);
    for (int k = 0; k < 50; ++k) CHECK(!bench.tick(p, q).recovering);  // nor does it go back in
    return ticks;
  }
  return most + 1;
}

}  // namespace

TEST_SUITE("rt_core.proxy_recovery") {
  TEST_CASE("every start in a union is led out, and no slower than straight") {
    Random random(3);
    for (const bool flush : {true, false}) {
      const tools::SceneDescription description =
          proxy_scene_of(led_part(), flush ? flush_cubes() : overlapping_hulls());
      const ProxyBench bench(description);
      const double step_m = static_cast<double>(bench.parameters.scale.recovery_step_m);
      const int most = static_cast<int>(0.1 / (3 * step_m)) + 10;
      for (int k = 0; k < 20; ++k) {
        CAPTURE(flush);
        CAPTURE(k);
        const Point p{random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02),
                      random.uniform(-0.02, 0.02)};
        const double turn = random.uniform(-0.5, 0.5);
        const std::array<double, 4> q{std::cos(turn), std::sin(turn), 0, 0};
        CHECK(ticks_until_free(description, p, q, most) <= most);
      }
    }
  }

  TEST_CASE("in the seam of two flush parts the shortest way out of both is taken") {
    const tools::SceneDescription two = proxy_scene_of(
        led_part(),
        {box({-0.03, -0.03, -0.02}, {0, 0.03, 0}), box({0, -0.03, -0.02}, {0.03, 0.03, 0})});
    ProxyBench bench(two);
    const Point p{0.0005, 0, -0.003};  // 7 mm to the top, half a millimetre to the seam
    while (bench.tick(p).recovering) continue;
    CHECK(static_cast<double>(bench.proxy.pose().x0_w[2]) == doctest::Approx(0.004).epsilon(0.01));
    CHECK(std::abs(static_cast<double>(bench.proxy.pose().x0_w[0]) - 0.0005) < 1e-6);
  }

  TEST_CASE("a part that never turns is led out by the planes of its C-obstacles") {
    tools::SceneDescription description = proxy_scene_of(led_part(), flush_cubes());
    description.orientation = tools::OrientationEnvelope{{0, 0, 0, 1}, 0.0};
    for (const double z : {0.0, 0.0095, -0.02}) {
      LoadedScene fixed(description);
      REQUIRE(fixed.view.is_locked());
      const Point p{0.0004, -0.0003, z};
      int ticks = 1;
      while ((fixed.step(p).flags & kFlagRecovery) != 0 && ticks < 1000) ++ticks;
      CHECK(ticks < 1000);
      CHECK(ticks > 10);
      const StepResult out = fixed.step(p);
      double outside_m = 0;  // of the block of all cubes, by the part's half sides
      const Point half{0.006, 0.005, 0.004};
      for (std::size_t k = 0; k < 3; ++k) {
        const double at =
            std::abs(static_cast<double>(out.proxy_pose_wa.p_wa[static_cast<int>(k)]));
        outside_m = std::max(outside_m, at - half[k] - 0.03);
      }
      CHECK(outside_m > -1e-6);
    }
  }

  TEST_CASE("with a small budget it takes longer and ends all the same") {
    tools::SceneDescription description = proxy_scene_of(led_part(), flush_cubes());
    description.parameters.work_units = 60;
    CHECK(ticks_until_free(description, {0.001, 0.002, 0.0005}, {1, 0, 0, 0}, 3000) <= 3000);
  }

  TEST_CASE("a part that starts free never recovers, however it is pressed and torn") {
    ProxyBench bench(proxy_scene_of(led_part(), flush_cubes()));
    Random random(5);
    static_cast<void>(bench.tick({0, 0, 0.06}));
    int recovering = 0, touching = 0;
    for (int k = 0; k < 2000; ++k) {
      const double s = 0.01 * k;
      const ProxyTick tick = bench.tick(
          {0.03 * std::sin(s), 0.03 * std::cos(1.7 * s), 0.03 + 0.02 * std::cos(0.9 * s)},
          {1, 0.2 * std::sin(s), 0.1 * std::cos(s), 0});
      recovering += tick.recovering ? 1 : 0;
      touching += bench.proxy.felt().plane_count > 0 ? 1 : 0;
    }
    CHECK(recovering == 0);
    CHECK(touching > 200);
  }
}
