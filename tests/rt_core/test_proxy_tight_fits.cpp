// SPDX-License-Identifier: Apache-2.0
// Friction where there is no room for a lift: a key in a slot, a peg in a square hole, a block in a
// corner. Coulomb's force at every clearance and speed, and rest once the hand rests.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/support/proxy_bench.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr double kStiffness_n_per_m = 1000, kHalf_m = 0.005, kLong_m = 0.025;

tools::Body part() { return box({-kHalf_m, -kHalf_m, -kLong_m}, {kHalf_m, kHalf_m, kLong_m}); }

/// Walls along z at x, and where `square` also at y.
tools::SceneDescription fit(double clearance_m, bool square, double mu) {
  const double w = kHalf_m + clearance_m / 2, far = 0.03, z = 0.1;
  std::vector<tools::Body> walls = {box({w, -far, -z}, {far, far, z}),
                                    box({-far, -far, -z}, {-w, far, z})};
  if (square) {
    walls.push_back(box({-far, w, -z}, {far, far, z}));
    walls.push_back(box({-far, -far, -z}, {far, -w, z}));
  }
  return proxy_scene_of(part(), walls, mu);
}

/// Walls at +x and +y alone, at a distance.
tools::SceneDescription corner(double distance_m, double mu) {
  const double w = kHalf_m + distance_m, far = 0.03, z = 0.1;
  return proxy_scene_of(part(),
                        {box({w, -far, -z}, {far, far, z}), box({-far, w, -z}, {far, far, z})}, mu);
}

/// Pressed by `press_n` along x, and where `both` along y, at walls `gap_m` away; then moved down
/// by `speed`. The largest error of the force along the way, as a share of `expected_n`.
double slide_error(const tools::SceneDescription& scene, double gap_m, bool both, double press_n,
                   double speed, double expected_n, std::uint32_t passes = kDefaultProxyPasses) {
  ProxyBench bench(scene, passes);
  const double deep_m = press_n / kStiffness_n_per_m + gap_m;
  const auto at = [&](double share, double way_m) {
    const double x = share * deep_m;
    return bench.tick({x, both ? x : 0, -way_m});
  };
  for (int k = 0; k <= 100; ++k) static_cast<void>(at(k / 100.0, 0));
  // The spring is stretched by what friction holds before the part slides.
  const double way_m = 2 * expected_n / kStiffness_n_per_m + std::max(0.002, 0.04 * speed);
  const int ticks = static_cast<int>(way_m / (1e-3 * speed));
  double worst = 0;
  for (int k = 0; k < ticks; ++k) {
    const ProxyTick tick = at(1, 1e-3 * speed * k);
    if (k < ticks / 2) continue;
    const double force_n = -kStiffness_n_per_m * static_cast<double>(tick.error.translation_m.z());
    worst = std::max(worst, std::abs(force_n / expected_n - 1));
  }
  return worst;
}

constexpr double kClearances_m[] = {1e-6, 1e-5, 1e-4, 1e-3};
constexpr double kSpeeds[] = {0.005, 0.02, 0.1, 0.3};
/// Single precision knows places of some cm to a few nm.
constexpr double kMostError = HAPTIC_REAL_IS_FLOAT ? 0.05 : 0.02;

}  // namespace

TEST_SUITE("rt_core.proxy_tight_fits") {
  TEST_CASE("a key in a slot and a peg in a square hole slide at mu N") {
    for (const bool square : {false, true}) {
      for (const double mu : {0.05, 0.3, 1.0}) {
        for (const double clearance : kClearances_m) {
          for (const double speed : kSpeeds) {
            CAPTURE(square);
            CAPTURE(mu);
            CAPTURE(clearance);
            CAPTURE(speed);
            constexpr double kPress_n = 0.5;
            CHECK(slide_error(fit(clearance, square, mu), clearance / 2, false, kPress_n, speed,
                              mu * kPress_n) <= kMostError);
          }
        }
      }
    }
  }

  TEST_CASE("so they do with one pass in a tick, and with five, pressed lightly and firmly") {
    for (const std::uint32_t passes : {1u, 5u}) {
      for (const double press_n : {0.2, 5.0}) {
        for (const double speed : {0.02, 0.3}) {
          CAPTURE(passes);
          CAPTURE(press_n);
          CAPTURE(speed);
          CHECK(slide_error(fit(1e-5, false, 0.3), 0.5e-5, false, press_n, speed, 0.3 * press_n,
                            passes) <= kMostError);
        }
      }
    }
  }

  TEST_CASE("in a corner mu times both normal forces, far below what would hold a part at rest") {
    // At rest friction between the walls could press the part into them and hold it up to
    // 1 / sqrt(1 - mu^2) of this.
    for (const double mu : {0.05, 0.3, 0.6}) {
      for (const double speed : kSpeeds) {
        for (const double press_n : {0.2, 0.5, 5.0}) {
          CAPTURE(mu);
          CAPTURE(speed);
          CAPTURE(press_n);
          CHECK(slide_error(corner(1e-5, mu), 1e-5, true, press_n, speed, 2 * mu * press_n) <=
                0.05);
        }
      }
    }
  }

  TEST_CASE("the judge of these cases sees a force that is a tenth off") {
    for (const double share : {0.9, 1.1}) {
      CHECK(slide_error(fit(1e-5, false, 0.3), 0.5e-5, false, 0.5, 0.1, share * 0.3 * 0.5) > 0.05);
    }
  }

  TEST_CASE("what has stopped stays: the wrench after 30 ticks is that after 500") {
    const struct {
      const char* name;
      tools::SceneDescription scene;
    } scenes[] = {{"slot, 10 um", fit(1e-5, false, 0.3)},
                  {"slot, 0.1 mm", fit(1e-4, false, 0.15)},
                  {"square hole, 10 um", fit(1e-5, true, 0.3)},
                  {"corner", corner(1e-5, 0.6)}};
    for (const auto& tried : scenes) {
      CAPTURE(std::string(tried.name));
      Random random(7);
      for (int stop = 0; stop < 12; ++stop) {
        ProxyBench bench(tried.scene);
        const auto number = [&] { return random.uniform(-1, 1); };
        const Point to{6e-4 * number(), 6e-4 * number(), 2e-3 * number()};
        const double turn[3] = {0.02 * number(), 0.02 * number(), 0.02 * number()};
        const auto at = [&](double s) {
          return bench.tick({s * to[0], s * to[1], s * to[2]},
                            {1, s * turn[0] / 2, s * turn[1] / 2, s * turn[2] / 2});
        };
        for (int k = 0; k <= 120; ++k) static_cast<void>(at(k / 120.0));
        ProxyTick tick;
        for (int k = 0; k < 30; ++k) tick = at(1);
        const PoseError rested = tick.error;
        for (int k = 0; k < 500; ++k) tick = at(1);
        const auto size = [](const Vec3& place, const Vec3& rotation) {
          return std::sqrt(place.squaredNorm() + Real(4e-4) * rotation.squaredNorm());
        };
        const Real moved = size(tick.error.translation_m - rested.translation_m,
                                tick.error.rotation_rad - rested.rotation_rad);
        CAPTURE(stop);
        CHECK(moved <= Real(0.02) * size(rested.translation_m, rested.rotation_rad));
      }
    }
  }
}
