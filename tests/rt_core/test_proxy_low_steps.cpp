// SPDX-License-Identifier: Apache-2.0
// Steps between faces of different parts, too low to be made on purpose: a part that is pressed on
// both and drawn over them feels no wall, and a step that is made holds it. 1000 N/m.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/proxy_bench.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr bool kStepSingle = HAPTIC_REAL_IS_FLOAT;
constexpr double kStepPress_n = 1.6, kStepStiffness_n_per_m = 1000;

/// A cube of 12 mm over two blocks, the one at positive x higher by `height_m`.
tools::SceneDescription stepped_blocks(double height_m, double friction = 0) {
  return proxy_scene_of(
      box({-0.006, -0.006, -0.006}, {0.006, 0.006, 0.006}),
      {box({-0.03, -0.03, -0.02}, {0, 0.03, 0}), box({0, -0.03, -0.02}, {0.03, 0.03, height_m})},
      friction);
}

struct StepCrossing {
  double largest_n = 0;       ///< along the way
  double least_gap_m = 0;     ///< of the part as it is felt
  double largest_rise_j = 0;  ///< of the spring's energy over a tick with a goal that rests
  double end_x_m = 0;         ///< of the part
  double tolerance_m = 0;     ///< depth that counts as free
};

/// Pressed and drawn from one block over the other, or back.
StepCrossing cross_step(const tools::SceneDescription& description, double speed_m_per_s, bool back,
                        double yaw_rad = 0) {
  ProxyBench bench(description);
  const std::array<double, 4> q{std::cos(yaw_rad / 2), 0, 0, std::sin(yaw_rad / 2)};
  const double way = back ? -1 : 1, depth = kStepPress_n / kStepStiffness_n_per_m;
  const double from = -0.015 * way;
  StepCrossing found;
  static_cast<void>(bench.tick({from, 0, 0.0062}, q));
  for (int k = 0; k <= 200; ++k)
    static_cast<void>(bench.tick({from, 0, 0.0062 - (depth + 2e-4) * k / 200}, q));
  const int ticks = static_cast<int>(0.03 / (speed_m_per_s * 1e-3));
  for (int k = 0; k <= ticks + 100; ++k) {
    const double x = from + way * 0.03 * std::min(1.0, static_cast<double>(k) / ticks);
    const ProxyTick tick = bench.tick({x, 0, 0.006 - depth}, q);
    found.largest_n =
        std::max(found.largest_n, kStepStiffness_n_per_m *
                                      std::abs(static_cast<double>(tick.error.translation_m[0])));
    found.least_gap_m =
        std::min(found.least_gap_m, static_cast<double>(bench.distance_m(bench.proxy.pose())));
    if (k > ticks) {
      found.largest_rise_j = std::max(
          found.largest_rise_j, static_cast<double>(tick.end_potential_j - tick.start_potential_j));
    }
  }
  found.end_x_m = static_cast<double>(bench.proxy.pose().x0_w[0]);
  found.tolerance_m = static_cast<double>(bench.parameters.scale.tolerance_m);
  CHECK(found.least_gap_m >= -(kStepSingle ? 4.0 : 1.01) * found.tolerance_m);
  CHECK(found.largest_rise_j <= 1e-12);
  return found;
}

}  // namespace

TEST_SUITE("rt_core.proxy_low_steps") {
  TEST_CASE("a step up to climb_m is passed with no more than its barrier, at any speed") {
    for (const double height : {0.0, 1e-9, 20e-9, 73e-9, 2e-7, 1e-6, 4e-6}) {
      for (const double speed : {0.002, 0.05, 0.3}) {
        for (const bool back : {false, true}) {
          CAPTURE(height);
          CAPTURE(speed);
          CAPTURE(back);
          const StepCrossing found = cross_step(stepped_blocks(height), speed, back);
          // sqrt(2 k F h), and what a tick comes along meanwhile. In single precision the
          // tolerance, 64 roundings of the scene, is above the lower steps: it starts as deep and
          // rises by h from there.
          const double rise_m = height + (kStepSingle ? found.tolerance_m : 0);
          const double barrier_n = std::sqrt(2 * kStepStiffness_n_per_m * kStepPress_n * rise_m);
          CHECK(found.largest_n <= barrier_n + kStepStiffness_n_per_m * speed * 1e-3 + 0.005);
          CHECK(std::abs(found.end_x_m - (back ? -0.015 : 0.015)) < 1e-5);
        }
      }
    }
  }

  TEST_CASE("turned parts pass too, and such that rub feel their friction alone") {
    for (const double height : {20e-9, 1e-6}) {
      const StepCrossing turned = cross_step(stepped_blocks(height), 0.05, false, 0.4);
      CHECK(turned.largest_n < 0.2);
      CHECK(std::abs(turned.end_x_m - 0.015) < 1e-5);
      const StepCrossing rubbing = cross_step(stepped_blocks(height, 0.3), 0.05, false);
      CHECK(rubbing.largest_n < 0.3 * kStepPress_n * 1.3 + 0.2);
      CHECK(rubbing.end_x_m > 0.014);
    }
  }

  TEST_CASE("a step that is made holds the part, and so does every step where none is climbed") {
    const StepCrossing made = cross_step(stepped_blocks(10e-6), 0.05, false);
    CHECK(made.largest_n > 10);
    CHECK(made.end_x_m < -0.005);
    CHECK(std::abs(cross_step(stepped_blocks(10e-6), 0.05, true).end_x_m + 0.015) <
          1e-5);  // down is free
    tools::SceneDescription high = stepped_blocks(10e-6);
    high.parameters.coupling.climb_m = 2e-5;
    CHECK(std::abs(cross_step(high, 0.05, false).end_x_m - 0.015) < 1e-5);
    tools::SceneDescription none = stepped_blocks(kStepSingle ? 4e-6 : 1e-6);
    none.parameters.coupling.climb_m = -1;
    CHECK(cross_step(none, 0.05, false).largest_n > 1);
  }

  TEST_CASE("a part that never turns climbs by the planes of its C-obstacles") {
    for (const double climb_m : {0.0, -1.0}) {
      tools::SceneDescription description = stepped_blocks(kStepSingle ? 2e-6 : 100e-9);
      description.orientation = tools::OrientationEnvelope{{0, 0, 0, 1}, 0.0};
      description.parameters.coupling.climb_m = climb_m;
      LoadedScene fixed(description);
      REQUIRE(fixed.view.is_locked());
      const double depth = kStepPress_n / kStepStiffness_n_per_m;
      double largest_n = 0;
      StepResult result = fixed.step({-0.015, 0, 0.0062});
      for (int k = 0; k <= 200; ++k)
        result = fixed.step({-0.015, 0, 0.0062 - (depth + 2e-4) * k / 200});
      for (int k = 0; k <= 600; ++k) {
        result = fixed.step({-0.015 + 5e-5 * k, 0, 0.006 - depth});
        largest_n = std::max(largest_n, std::abs(static_cast<double>(result.wrench_w.force_w[0])));
      }
      CAPTURE(climb_m);
      CHECK(((largest_n < 0.2) == (climb_m == 0)));
      CHECK(((std::abs(static_cast<double>(result.proxy_pose_wa.p_wa[0]) - 0.015) < 1e-5) ==
             (climb_m == 0)));
    }
  }
}
