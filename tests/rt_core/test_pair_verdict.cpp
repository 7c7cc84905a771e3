// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <vector>

#include "tests/support/pair_bench.hpp"

using namespace haptic;
using namespace haptic::test;

TEST_SUITE("rt_core.pair_verdict") {
  TEST_CASE("agrees with the exhaustive search, warm and cold, aligned and generic") {
    const tools::Body bodies[] = {
        box({-0.05, -0.04, -0.03}, {0.05, 0.04, 0.03}), prism(12, 0.04, 0.08),
        tetrahedron({0.05, 0, -0.03}, {-0.03, 0.04, -0.03}, {-0.03, -0.04, -0.03}, {0, 0, 0.06}),
        box({-0.05, -0.0015, -0.0015}, {0.05, 0.0015, 0.0015})};
    Random random(31);
    int separated = 0, colliding = 0, wrong = 0, undecided = 0;
    std::uint32_t most = 0;
    for (std::size_t pair = 0; pair < 8; ++pair) {
      PairBench bench(bodies[pair % 4],
                      bodies[pair < 4 ? 0 : 3]);  // against the box, then the needle
      VerdictMemory memory;
      for (int k = 0; k < 6000; ++k) {
        const bool aligned = k % 3 == 0;
        std::array<double, 4> q = aligned ? std::array<double, 4>{1, 0, 0, 0} : random.rotation();
        if (k % 6 == 3) q = {1, random.uniform(-1e-9, 1e-9), random.uniform(-1e-14, 1e-14), 0};
        const Point x = {random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1),
                         random.uniform(-0.1, 0.1)};
        const PairPose& pose = bench.at(x, q);
        const Real d = bench.exhaustive_d_near();
        if (k % 4 == 0) memory = VerdictMemory{};
        const VerdictResult verdict =
            k % 2 == 0 ? portal_verdict(pose, memory) : pair_verdict(pose, bench.search(), memory);
        most = std::max(most, verdict.support_pairs);
        const Real rounding = 1000 * kRealEpsilon * pose.size_m;
        if (verdict.verdict == Verdict::kUndecided) ++undecided;
        if (verdict.verdict == Verdict::kSeparated) {
          ++separated;
          CHECK(verdict.separation_bound_m > 0);
          if (d < -rounding) ++wrong;
        } else if (verdict.verdict == Verdict::kColliding) {
          ++colliding;
          if (d > rounding) ++wrong;
        }
      }
    }
    CHECK(wrong == 0);
    CHECK(undecided == 0);
    CHECK(separated > 3000);
    CHECK(colliding > 3000);
    CHECK(most <= kMaxSupportPairsPerVerdict);
    MESSAGE("separated " << separated << ", colliding " << colliding << ", most support pairs "
                         << most);
  }

  TEST_CASE("the interior point itself and touching bodies collide") {
    PairBench bench(box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05}),
                    box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05}));
    VerdictMemory memory;
    CHECK(portal_verdict(bench.at({0, 0, 0}, {1, 0, 0, 0}), memory).verdict == Verdict::kColliding);
    memory = VerdictMemory{};
    CHECK(portal_verdict(bench.at({0.1, 0, 0}, {1, 0, 0, 0}), memory).verdict !=
          Verdict::kSeparated);
    memory = VerdictMemory{};
    const VerdictResult apart = portal_verdict(bench.at({0.1001, 0, 0}, {1, 0, 0, 0}), memory);
    CHECK(apart.verdict == Verdict::kSeparated);
    CHECK(apart.separation_bound_m <= 0.0001_r * 1.01_r);
  }
}
