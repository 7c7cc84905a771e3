// SPDX-License-Identifier: Apache-2.0
// The list of near pairs among many facets, made in slices while the part moves on: against the
// distance of every pair of facets from their corners.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "rt_core/base/arena.hpp"
#include "rt_core/proxy/near_pairs.hpp"
#include "tests/host_sim/nut_on_rod.hpp"
#include "tests/support/shapes.hpp"

using namespace haptic;
using namespace haptic::sim;
using haptic::test::LoadedScene;

namespace {

struct ListBench {
  explicit ListBench(std::uint32_t slots) : scene(nut_on_rod()) {
    Arena counting;
    NearPairs sized;
    sized.place(counting, scene.view, slots, false);
    memory.resize(counting.used() / sizeof(std::max_align_t) + 1);
    Arena arena(reinterpret_cast<std::byte*>(memory.data()));
    list.place(arena, scene.view, slots, false);
    list.read_scene(scene.view);
    of_a = scene.view.bodies()[0].piece_count;
    const auto pieces = static_cast<std::uint32_t>(scene.view.pieces().size());
    for (std::uint32_t a = 0; a < of_a; ++a) {
      for (std::uint32_t b = of_a; b < pieces; ++b) {
        pair.push_back(scene.view.find_pair(a, b));
      }
    }
  }

  /// Finds the distance of every pair at `p`.
  void measure() {
    const auto pieces = static_cast<std::uint32_t>(scene.view.pieces().size());
    for (std::uint32_t a = 0; a < of_a; ++a) {
      for (std::uint32_t b = of_a; b < pieces; ++b) {
        // A pair that is farther than any list here says need not be known closer.
        const double apart_m = ball_distance(scene.view.piece(a), p, scene.view.piece(b));
        distance_m.push_back(
            apart_m > 4e-3 ? apart_m : facet_distance(scene.view.piece(a), p, scene.view.piece(b)));
      }
    }
  }

  /// Makes a list in slices of `visits`, which may shrink to `least_m`; @return slices.
  int make(Real range_m, std::uint32_t visits, Real least_m) {
    list.begin(p, 1.0, range_m);
    int slices = 1;
    while (!list.go_on(visits, 1.0, least_m)) slices += 1;
    return slices;
  }

  /// Gap in the list of each pair, by index in `pair`; negative where it is not in it.
  std::vector<double> gaps() const {
    std::vector<double> by_pair(pair.size(), -1.0);
    for (const std::uint32_t slot : list.slots()) {
      const auto at = std::find(pair.begin(), pair.end(), list[slot].pair);
      by_pair[static_cast<std::size_t>(at - pair.begin())] =
          std::max(0.0, static_cast<double>(list[slot].gap_m));
    }
    return by_pair;
  }

  /// Pairs that are nearer than the list says.
  int too_near(double unlisted_m) const {
    const std::vector<double> gap = gaps();
    int wrong = 0;
    for (std::size_t k = 0; k < pair.size(); ++k) {
      const double bound_m = gap[k] < 0 ? unlisted_m : gap[k];
      wrong += distance_m[k] < bound_m - 1e-12 ? 1 : 0;
    }
    return wrong;
  }

  LoadedScene scene;
  GripPose p{Vec3(1e-4_r, -5e-5_r, 2e-5_r), Quat::Identity(), Mat3::Identity()};
  std::vector<std::max_align_t> memory;
  NearPairs list;
  std::uint32_t of_a = 0;
  std::vector<PairIndex> pair;
  std::vector<double> distance_m;
};

}  // namespace

TEST_SUITE("host_sim.near_pair_list") {
  TEST_CASE("every pair within the range is listed, and none is nearer than it says") {
    ListBench bench(16384);
    bench.measure();
    const int slices = bench.make(3e-4_r, 50, 3e-4_r);
    CHECK(slices > 10);
    CHECK(bench.list.unlisted_m(1.0) > 3e-4_r);
    CHECK(bench.too_near(static_cast<double>(bench.list.unlisted_m(1.0))) == 0);
    CHECK(bench.too_near(3e-3) > 0);  // a bound too large is seen
    const std::vector<double> gap = bench.gaps();
    int near = 0;
    for (std::size_t k = 0; k < gap.size(); ++k) {
      if (bench.distance_m[k] > 3e-4) continue;
      near += 1;
      CHECK(gap[k] >= 0);
    }
    CHECK(near > 50);
    CHECK(bench.list.slots().size() < gap.size() / 2);
    CHECK(bench.list.unlisted_m(1.0 + 1e-4) < bench.list.unlisted_m(1.0) - 0.9e-4_r);
  }

  TEST_CASE("slices change nothing; the list before stays until the next is finished") {
    ListBench once(4096), sliced(4096);
    once.make(2e-4_r, 1u << 30, 2e-4_r);
    sliced.make(2e-4_r, 64, 2e-4_r);
    CHECK(once.gaps() == sliced.gaps());
    const std::vector<double> before = sliced.gaps();
    sliced.p.x0_w[2] += 1e-4_r;
    sliced.list.begin(sliced.p, 2.0, 2e-4_r);
    CHECK(!sliced.list.go_on(64, 2.0, 2e-4_r));
    CHECK(sliced.gaps() == before);
    while (!sliced.list.go_on(64, 2.0, 2e-4_r)) continue;
    CHECK(sliced.gaps() != before);
  }

  TEST_CASE("a full pool keeps the nearest and bounds the others") {
    ListBench bench(40);
    bench.measure();
    bench.make(3e-4_r, 100, 3e-4_r);
    CHECK(bench.list.slots().size() == 40);
    CHECK(bench.list.overflowed());
    REQUIRE(bench.list.left_out().size() > 0);
    // Those without a slot are bounded together, or by their groups.
    Real left_m = bench.list.unlisted_m(1.0);
    for (const LeftOut& left : bench.list.left_out()) left_m = std::min(left_m, left.gap_m);
    CHECK(bench.too_near(static_cast<double>(left_m)) == 0);
    CHECK(bench.too_near(static_cast<double>(bench.list.unlisted_m(1.0))) > 0);
  }

  TEST_CASE("a full pool whose range may shrink asks no face and leaves none aside") {
    ListBench bench(1024), asked(1024);
    bench.measure();
    bench.make(3e-3_r, 100, 1e-5_r);
    CHECK(bench.list.slots().size() == 1024);
    CHECK(bench.list.overflowed());
    CHECK(bench.list.left_out().size() == 0);
    const Real left_m = bench.list.unlisted_m(1.0);
    CHECK(left_m > 1e-5_r);
    CHECK(left_m < 3e-3_r);
    CHECK(bench.too_near(static_cast<double>(left_m)) == 0);
    CHECK(bench.too_near(3e-3) > 0);
    asked.make(3e-3_r, 100, 3e-3_r);
    CHECK(asked.list.visited() > 2 * bench.list.visited());
  }
}
