// SPDX-License-Identifier: Apache-2.0
// Facets screened in bulk while a nut turns and slides on its rod: what the screen certifies is
// apart all along the way, by the corners of every pair of facets.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "rt_core/base/arena.hpp"
#include "rt_core/law/coupling.hpp"
#include "rt_core/proxy/facet_screen.hpp"
#include "rt_core/proxy/near_pairs.hpp"
#include "tests/host_sim/nut_on_rod.hpp"
#include "tests/support/all_checks.hpp"
#include "tests/support/random.hpp"
#include "tests/support/shapes.hpp"

using namespace haptic;
using namespace haptic::sim;
using haptic::test::LoadedScene;
using haptic::test::Random;
using haptic::test::trials;

namespace {

constexpr bool kScreenSingle = HAPTIC_REAL_IS_FLOAT;
constexpr Real kTolerance_m = kScreenSingle ? 2e-6_r : 1e-7_r;
constexpr Real kLeast_m = 1.55_r * kTolerance_m, kDip_m = kTolerance_m / 2;
constexpr Real kRange_m = 3e-4_r;
constexpr std::uint32_t kNoLimit = 1u << 30;
const int kSamples = trials(2, 4);
/// The nut needs about a hundred steps to the rod. On its way there the short form measures the
/// facets that are certified, all of them far apart, in each fourth step.
const int kApproach = trials(90, 0);
/// Pairs farther apart than this are not measured.
constexpr double kFar_m = 1e-4;

struct ScreenBench {
  ScreenBench() : ScreenBench(nut_on_rod(), Vec3(1e-4_r, -5e-5_r, 2e-5_r)) {}
  ScreenBench(const std::vector<std::byte>& bytes, const Vec3& x0_w)
      : scene(bytes), p{x0_w, Quat::Identity(), Mat3::Identity()} {
    REQUIRE(FacetScreen::serves(scene.view));
    Arena counting;
    NearPairs no_pairs;
    FacetScreen no_screen;
    no_pairs.place(counting, scene.view, kScreenedSlots, true);
    no_screen.place(counting, scene.view);
    memory.resize(counting.used() / sizeof(Line) + 1);
    Arena arena(reinterpret_cast<std::byte*>(memory.data()));
    taken.place(arena, scene.view, kScreenedSlots, true);
    screen.place(arena, scene.view);
    taken.read_scene(scene.view);
    screen.read_scene(scene.view);
    of_a = scene.view.bodies()[0].piece_count;
    of_b = static_cast<std::uint32_t>(scene.view.pieces().size()) - of_a;
  }

  /// The pairs that the last call has missed are taken.
  void take_missed() {
    for (const ScreenMiss& miss : screen.misses()) {
      REQUIRE(taken.add(miss.piece_a, miss.facet, miss.gap_m) != NearPairs::kNoSlot);
      screen.drop(miss);
    }
  }

  /// Lists what is near, and certifies all pairs that are not taken from p to q.
  bool certify(const GripPose& q, const Vec3& dx_m, const Vec3& dtheta_rad) {
    const FacetScreen::Way way{p,        q,     dx_m, dtheta_rad, dx_m.norm(), dtheta_rad.norm(),
                               kLeast_m, kDip_m};
    screen.renew(p, 2e-5_r, kRange_m, kLeast_m, kNoLimit, taken);
    take_missed();
    if (screen.clear_m() <= way.far_m + way.turn_rad * 0.012_r) return false;
    screen.sweep(way);
    for (;;) {
      const FacetScreen::Search end = screen.search(way, kNoLimit);
      take_missed();
      REQUIRE(end != FacetScreen::Search::kSpent);
      if (end == FacetScreen::Search::kDone) return true;
    }
  }

  /// The smallest distance of the taken pairs, or of all others, at a pose; farther than kFar_m:
  /// that.
  double least_distance(const GripPose& at, bool of_taken) const {
    double least = kFar_m;
    for (std::uint32_t a = 0; a < of_a; ++a) {
      for (std::uint32_t b = 0; b < of_b; ++b) {
        if (taken.has(a, b) != of_taken) continue;
        const PieceView of_nut = scene.view.piece(a), of_rod = scene.view.piece(of_a + b);
        if (ball_distance(of_nut, at, of_rod) > least) continue;
        least = std::min(least, facet_distance(of_nut, at, of_rod));
      }
    }
    return least;
  }

  struct alignas(64) Line {
    std::byte bytes[64];
  };
  LoadedScene scene;
  GripPose p;
  std::vector<Line> memory;
  NearPairs taken;
  FacetScreen screen;
  std::uint32_t of_a = 0, of_b = 0;
};

/// A short step, more down than up.
void random_step(Random& random, Vec3& dx_m, Vec3& dtheta_rad) {
  const double size = random.uniform(0, 1);
  for (int k = 0; k < 3; ++k) {
    const bool along = k == 2;  // the axis of the thread
    dx_m[k] = static_cast<Real>(size * random.uniform(-1, along ? 0 : 1) * (along ? 1e-5 : 3e-6));
    dtheta_rad[k] = static_cast<Real>(size * random.uniform(-1, 1) * (along ? 4e-3 : 2e-4));
  }
}

}  // namespace

TEST_SUITE("host_sim.facet_screen") {
  TEST_CASE("what is certified is apart all along the way, and what is taken is little") {
    ScreenBench bench;
    Random random(31);
    int steps = 0, close = 0;
    double least_m = kFar_m;
    for (int trial = 0; trial < 160; ++trial) {
      Vec3 dx_m, dtheta_rad;
      random_step(random, dx_m, dtheta_rad);
      const GripPose q = moved(bench.p, dx_m, dtheta_rad);
      if (!bench.certify(q, dx_m, dtheta_rad)) continue;
      bool is_free = true;
      for (int k = 1; k <= kSamples && is_free; ++k) {
        const Real share = static_cast<Real>(k) / static_cast<Real>(kSamples);
        const GripPose at = moved(bench.p, share * dx_m, share * dtheta_rad);
        if (trial >= kApproach || trial % 4 == 0) {
          const double apart_m = bench.least_distance(at, false);
          CHECK(apart_m >= static_cast<double>(kLeast_m - kDip_m) * (1 - 1e-6));
          least_m = std::min(least_m, apart_m);
        }
        is_free = bench.least_distance(at, true) > static_cast<double>(kLeast_m);
      }
      if (!is_free) {  // the law would not make this step
        close += 1;
        bench.screen.forget_end();
        continue;
      }
      bench.p = q;
      bench.screen.accept(q, dx_m.norm(), dtheta_rad.norm());
      CHECK(bench.screen.is_settled());
      steps += 1;
      // Each third one asks for its pairs back.
      const std::vector<std::uint32_t> slots(bench.taken.slots().begin(),
                                             bench.taken.slots().end());
      for (const std::uint32_t slot : slots) {
        if (steps % 3 != 0) continue;
        const PairRecord record = bench.scene.view.pair_record(bench.taken[slot].pair);
        if (bench.screen.take_back(record.piece_a, record.piece_b - bench.of_a, bench.p,
                                   1.9_r * kTolerance_m)) {
          bench.taken.remove(slot);
        }
      }
    }
    CHECK(steps > 40);
    CHECK(close > 0);
    CHECK(least_m < 1e-5);  // facets were near, so a bound too large would have been seen
    CHECK(bench.taken.slots().size() < 200);
  }

  // Corners of the plate are farther from the ball than single precision tells.
  TEST_CASE("small facets over a large one: apart all along the way, to the nanometre") {
    const std::vector<std::byte> scene = ball_on_plate();
    const Mat3 turn = plate_turn().toRotationMatrix();
    Random random(32);
    int steps = 0, close = 0;
    for (int place = 0; place < trials(10, 40); ++place) {
      const auto aside = [&] { return static_cast<Real>(random.uniform(-0.08, 0.08)); };
      ScreenBench bench(scene, turn * Vec3(aside(), aside(), 0.01005_r));
      // Three tolerances above the plate.
      const double tolerance_m = static_cast<double>(kTolerance_m);
      const double far_m = bench.least_distance(bench.p, false) - 3 * tolerance_m;
      bench.p.x0_w -= static_cast<Real>(far_m) * turn.col(2);
      for (int trial = 0; trial < 30; ++trial) {
        Vec3 dx_m, dtheta_rad;
        random_step(random, dx_m, dtheta_rad);
        dx_m.z() = static_cast<Real>(random.uniform(-0.8, 0.4)) * kTolerance_m;
        dx_m = turn * dx_m;
        dtheta_rad *= 0.01_r;
        const GripPose q = moved(bench.p, dx_m, dtheta_rad);
        if (!bench.certify(q, dx_m, dtheta_rad)) continue;
        const double apart_m = bench.least_distance(q, false);
        CHECK(apart_m >= static_cast<double>(kLeast_m));
        close += apart_m < static_cast<double>(kLeast_m) + 0.1 * tolerance_m ? 1 : 0;
        if (bench.least_distance(q, true) > static_cast<double>(kLeast_m)) {
          bench.p = q;
          bench.screen.accept(q, dx_m.norm(), dtheta_rad.norm());
          steps += 1;
        } else {
          bench.screen.forget_end();
        }
        // Nothing stays the law's that is apart.
        const std::vector<std::uint32_t> slots(bench.taken.slots().begin(),
                                               bench.taken.slots().end());
        for (const std::uint32_t slot : slots) {
          const PairRecord record = bench.scene.view.pair_record(bench.taken[slot].pair);
          if (bench.screen.take_back(record.piece_a, record.piece_b - bench.of_a, bench.p,
                                     kLeast_m)) {
            bench.taken.remove(slot);
          }
        }
      }
    }
    CHECK(steps > 100);
    CHECK(close > 4);  // as near as is certified
  }

  TEST_CASE("a pair comes and goes by its slot") {
    ScreenBench bench;
    CHECK(!bench.taken.has(3, 5));
    std::vector<std::uint32_t> slots;
    for (std::uint32_t b = 0; b < 100; ++b) slots.push_back(bench.taken.add(3, b, 1e-6_r));
    CHECK(bench.taken.add(3, 5, 0) == slots[5]);
    CHECK(bench.taken.slots().size() == 100);
    for (std::uint32_t b = 0; b < 100; b += 2) bench.taken.remove(slots[b]);
    for (std::uint32_t b = 0; b < 100; ++b) CHECK(bench.taken.has(3, b) == (b % 2 == 1));
    CHECK(bench.taken.slots().size() == 50);
    std::uint32_t more = 0;
    while (bench.taken.add(4, more, 0) != NearPairs::kNoSlot) more += 1;
    CHECK(more == kScreenedSlots - 50);
    CHECK(!bench.taken.has(4, more));
  }

  TEST_CASE("without work no list is made, and the slack says so") {
    ScreenBench bench;
    bench.screen.renew(bench.p, 2e-5_r, kRange_m, kLeast_m, 0, bench.taken);
    CHECK(bench.screen.clear_m() < 0);
    bench.screen.renew(bench.p, 2e-5_r, kRange_m, kLeast_m, kNoLimit, bench.taken);
    CHECK(bench.screen.clear_m() > 2e-5_r);
    bench.screen.accept(bench.p, 1e-5_r, 0);
    CHECK(bench.screen.clear_m() < kRange_m);
    CHECK_FALSE(bench.screen.is_settled());
  }

  TEST_CASE("a step through the rod is missed somewhere") {
    ScreenBench bench;
    const Vec3 dx_m(0, 0, -4e-4_r), dtheta_rad = Vec3::Zero();
    const GripPose q = moved(bench.p, dx_m, dtheta_rad);
    bench.screen.renew(bench.p, 1e-3_r, 8e-3_r, kLeast_m, kNoLimit, bench.taken);
    bench.take_missed();
    const std::size_t before = bench.taken.slots().size();
    bench.screen.sweep({bench.p, q, dx_m, dtheta_rad, dx_m.norm(), 0, kLeast_m, kDip_m});
    const FacetScreen::Way way{bench.p, q, dx_m, dtheta_rad, dx_m.norm(), 0, kLeast_m, kDip_m};
    static_cast<void>(bench.screen.search(way, kNoLimit));
    bench.take_missed();
    CHECK(bench.taken.slots().size() > before);
  }
}
