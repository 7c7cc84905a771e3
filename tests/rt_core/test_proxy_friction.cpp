// SPDX-License-Identifier: Apache-2.0
// Friction of the proxy: the cone in all directions, torsion of a patch, stick, and static above
// kinetic friction. A box of 40 x 30 x 20 mm pressed 5 mm into a floor, k_t = 1000 N/m, 1 kHz.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/proxy_bench.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr double kMu = 0.4, kDepth_m = 0.005, kHalfHeight_m = 0.01;
constexpr double kStiffness_n_per_m = 1000;
constexpr double kCorner_m = 0.025;  // from the grip's normal to a corner of the patch

tools::SceneDescription rubbing_scene(double mu, double mu_static = 0) {
  tools::SceneDescription scene =
      proxy_scene_of(box({-0.02, -0.015, -kHalfHeight_m}, {0.02, 0.015, kHalfHeight_m}),
                     {box({-0.3, -0.3, -0.02}, {0.3, 0.3, 0})}, mu);
  for (tools::PlacedBody& body : scene.statics) body.friction_static = mu_static;
  return scene;
}

/// Pressed straight down to kDepth_m.
void press(ProxyBench& bench) {
  for (int k = 0; k <= 60; ++k)
    static_cast<void>(bench.tick({0, 0, kHalfHeight_m + 0.002 - 0.002 * k / 60}));
  for (int k = 0; k <= 100; ++k)
    static_cast<void>(bench.tick({0, 0, kHalfHeight_m - kDepth_m * k / 100}));
}

struct Pull {
  double x_n = 0, y_n = 0, normal_n = 0, torque_nm = 0;
};
Pull pull_of(const ProxyBench& bench, const ProxyTick& tick) {
  const Vec3 t = tick.error.translation_m;
  return {kStiffness_n_per_m * static_cast<double>(t.x()),
          kStiffness_n_per_m * static_cast<double>(t.y()),
          -kStiffness_n_per_m * static_cast<double>(t.z()),
          static_cast<double>(bench.parameters.spring.k_r_nm_per_rad) *
              static_cast<double>(tick.error.rotation_rad.z())};
}

double counted(double x, double count) { return count > 0 ? std::round(x / count) * count : x; }

/// Largest errors of one drag at `speed` along every degree: share of mu N along and across the
/// way, share of N.
struct ConeError {
  double along = 0, across = 0, normal = 0;
};
ConeError cone_error(double speed_m_per_s) {
  ConeError worst;
  const int ticks = static_cast<int>(kMu * kDepth_m / (1e-3 * speed_m_per_s)) + 60;
  for (int degree = 0; degree < 360; ++degree) {
    const double a = degree * std::numbers::pi / 180;
    ProxyBench bench(rubbing_scene(kMu));
    press(bench);
    for (int k = 0; k < ticks; ++k) {
      const double way = 1e-3 * speed_m_per_s * k;
      const Pull pull = pull_of(
          bench, bench.tick({way * std::cos(a), way * std::sin(a), kHalfHeight_m - kDepth_m}));
      if (k < ticks - 20) continue;
      const double most = kMu * pull.normal_n;
      const double along = pull.x_n * std::cos(a) + pull.y_n * std::sin(a);
      const double across = pull.y_n * std::cos(a) - pull.x_n * std::sin(a);
      worst.along = std::max(worst.along, std::abs(along / most - 1));
      worst.across = std::max(worst.across, std::abs(across) / most);
      worst.normal =
          std::max(worst.normal, std::abs(pull.normal_n / (kStiffness_n_per_m * kDepth_m) - 1));
    }
  }
  return worst;
}

/// Spun at 0.5 rad/s: mean torque and its noise, the standard deviation over the mean.
struct Spin {
  double torque_nm = 0, noise = 0, normal_n = 0;
};
Spin spin(double tremor_m, double count_m) {
  ProxyBench bench(rubbing_scene(kMu));
  Random random(11);
  press(bench);
  double sum = 0, squares = 0, normal = 0;
  constexpr int kTicks = 2500, kFrom = 1000;
  const auto place = [&](double x) {
    return counted(x + tremor_m * random.uniform(-1, 1), count_m);
  };
  for (int k = 0; k < kTicks; ++k) {
    const double angle = counted(5e-4 * k, count_m / 0.05);
    const Point p{place(0), place(0), place(kHalfHeight_m - kDepth_m)};
    const Pull pull =
        pull_of(bench, bench.tick(p, {std::cos(angle / 2), 0, 0, std::sin(angle / 2)}));
    if (k < kFrom) continue;
    sum += pull.torque_nm;
    squares += pull.torque_nm * pull.torque_nm;
    normal += pull.normal_n;
  }
  constexpr int kKept = kTicks - kFrom;
  const double mean = sum / kKept;
  return {mean, std::sqrt(std::max(0.0, squares / kKept - mean * mean)) / mean, normal / kKept};
}

/// One side of a groove along x whose flanks rise at 45 degrees from the origin; `side`: 1 or -1.
tools::Body flank(double side) {
  const auto at = [&](double x, double y, double z) { return Point{x, side * y, z}; };
  const std::vector<Point> vertices{at(-0.3, 0, 0), at(-0.3, 0.1, 0.1), at(-0.3, 0.1, -0.05),
                                    at(0.3, 0, 0),  at(0.3, 0.1, 0.1),  at(0.3, 0.1, -0.05)};
  std::vector<std::vector<std::uint32_t>> faces{
      {0, 1, 2}, {3, 5, 4}, {0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}};
  if (side < 0) {
    for (auto& face : faces) std::ranges::reverse(face);
  }
  return convex_body(vertices, faces);
}

/// Force along a groove over mu N, with N of both flanks, of a square bar that is pressed into it
/// and drawn along it.
double groove_friction(double mu, double speed_m_per_s) {
  ProxyBench bench(proxy_scene_of(
      box({-0.02, -kHalfHeight_m, -kHalfHeight_m}, {0.02, kHalfHeight_m, kHalfHeight_m}),
      {flank(1), flank(-1)}, mu));
  const std::array<double, 4> on_edge{std::cos(std::numbers::pi / 8),
                                      std::sin(std::numbers::pi / 8), 0, 0};
  const double seat = std::numbers::sqrt2 * kHalfHeight_m;
  for (int k = 0; k <= 160; ++k) {
    static_cast<void>(bench.tick({0, 0, seat + 0.003 - 5e-5 * k}, on_edge));
  }
  double sum = 0;
  constexpr int kMeasured = 50;
  const int ticks = static_cast<int>(2 * mu * kDepth_m / (1e-3 * speed_m_per_s)) + 100;
  for (int k = 0; k < ticks; ++k) {
    const Pull pull =
        pull_of(bench, bench.tick({1e-3 * speed_m_per_s * k, 0, seat - kDepth_m}, on_edge));
    if (k < ticks - kMeasured) continue;
    sum += pull.x_n / (mu * std::numbers::sqrt2 * pull.normal_n);
  }
  return sum / kMeasured;
}

}  // namespace

TEST_SUITE("rt_core.proxy_friction") {
  TEST_CASE("sliding: the force is mu N against the way, within 2 %, in 360 directions") {
    for (const double speed : {0.02, 0.2}) {
      CAPTURE(speed);
      const ConeError worst = cone_error(speed);
      MESSAGE("speed " << speed << " m/s: along " << worst.along << ", across " << worst.across
                       << ", normal " << worst.normal);
      CHECK(worst.along <= 0.02);
      CHECK(worst.across <= 0.02);
      CHECK(worst.normal <= 0.002);
    }
  }

  TEST_CASE("in a groove the force is mu times the normal forces of both flanks") {
    for (const double mu : {0.15, 0.4}) {
      for (const double speed : {0.01, 0.1}) {
        CAPTURE(mu);
        CAPTURE(speed);
        const double share = groove_friction(mu, speed);
        MESSAGE("mu " << mu << ", " << speed << " m/s: " << share);
        CHECK(share == doctest::Approx(1).epsilon(0.005));
      }
    }
  }

  TEST_CASE("torsion: mu N at the corners of the patch, with tremor and counts, without noise") {
    for (const double count : {0.0, 1e-6, 1e-5, 6e-5}) {
      for (const double tremor : {0.0, 1e-7}) {
        CAPTURE(count);
        CAPTURE(tremor);
        const Spin found = spin(tremor, count);
        MESSAGE("count " << count << " tremor " << tremor << ": noise " << found.noise
                         << ", torque " << found.torque_nm);
        CHECK(found.noise <= 0.02);
        CHECK(std::abs(found.torque_nm / (kMu * found.normal_n * kCorner_m) - 1) <= 0.03);
      }
    }
  }

  TEST_CASE("stick: the part stays to the bit for 60 s, with tremor of place and turn") {
    for (const double direction : {0.0, 0.5, std::numbers::pi / 4}) {
      for (const double tremor : {0.0, 1e-7}) {
        ProxyBench bench(rubbing_scene(kMu));
        Random random(12);
        press(bench);
        const double pull = 0.8 * kMu * kDepth_m;
        const double x = pull * std::cos(direction), y = pull * std::sin(direction);
        for (int k = 0; k <= 100; ++k)
          static_cast<void>(bench.tick({x * k / 100, y * k / 100, kHalfHeight_m - kDepth_m}));
        GripPose stood;
        bool still = true;
        for (int k = 0; k < 60000; ++k) {
          const auto shake = [&] { return tremor * random.uniform(-1, 1); };
          const double dx = shake(), dy = shake(), dz = shake();
          static_cast<void>(bench.tick({x + dx, y + dy, kHalfHeight_m - kDepth_m + dz},
                                       {1, 10 * shake(), 10 * shake(), 10 * shake()}));
          if (k == 100) stood = bench.proxy.pose();
          if (k > 100) {
            still = still && bench.proxy.pose().x0_w == stood.x0_w &&
                    bench.proxy.pose().q_wa.coeffs() == stood.q_wa.coeffs();
          }
        }
        CAPTURE(direction);
        CAPTURE(tremor);
        CHECK(still);
      }
    }
  }

  TEST_CASE("static friction holds to mu_s N, then the force falls to mu N, and sticks again") {
    constexpr double kMuStatic = 0.6;
    ProxyBench bench(rubbing_scene(kMu, kMuStatic));
    press(bench);
    const double z = kHalfHeight_m - kDepth_m;
    double x = 0, work_j = 0;
    Pull last;
    const auto go = [&](double to) {
      const Pull pull = pull_of(bench, bench.tick({to, 0, z}));
      work_j += (last.x_n + pull.x_n) / 2 * (to - x);
      x = to;
      last = pull;
      return pull;
    };
    const auto wait = [&] {
      for (std::uint32_t k = 0; k < 2 * kStickTicks; ++k) static_cast<void>(go(x));
    };
    wait();
    for (int round = 0; round < 2; ++round) {
      double peak = 0;
      for (int k = 0; k < 80; ++k) peak = std::max(peak, go(x + 5e-5).x_n);
      const double normal = last.normal_n;
      CHECK(peak == doctest::Approx(kMuStatic * normal).epsilon(0.03));
      CHECK(last.x_n == doctest::Approx(kMu * normal).epsilon(0.03));
      wait();  // at the border of the cone it stands still: it sticks
    }
    const double at_end = x;
    for (int k = 0; k < 400; ++k) static_cast<void>(go(x - at_end / 400));
    CHECK(work_j > 1e-3);  // most of the way against mu N
  }

  TEST_CASE("closed loops never give energy: 20 random ones, sliding, turning and sticking") {
    Random random(13);
    for (int loop = 0; loop < 20; ++loop) {
      ProxyBench bench(rubbing_scene(0.1 + 0.04 * loop, loop % 2 == 0 ? 1.2 : 0.0));
      press(bench);
      const double a = random.uniform(0.001, 0.01), b = random.uniform(0.001, 0.01);
      const double w = random.uniform(0.05, 0.5);
      double work_j = 0, left_j = 0;
      constexpr int kTicks = 2000;
      for (int k = 0; k <= 2 * kTicks; ++k) {
        const double s = 2 * std::numbers::pi * k / kTicks;
        const double turn = w * std::sin(s);
        const ProxyTick tick = bench.tick({a * std::sin(s), b * std::sin(2 * s),
                                           kHalfHeight_m - kDepth_m * (0.6 + 0.4 * std::cos(s))},
                                          {std::cos(turn / 2), 0, 0, std::sin(turn / 2)});
        // A goal that moves while p stands changes V by the hand's work.
        if (k > kTicks) work_j += static_cast<double>(tick.start_potential_j) - left_j;
        left_j = static_cast<double>(tick.end_potential_j);
        CHECK(tick.end_potential_j <= tick.start_potential_j);
      }
      CHECK(work_j >= -1e-8);
    }
  }
}
