// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "host_sim/oracle/exhaustive.hpp"
#include "host_sim/oracle/scene_oracle.hpp"
#include "tests/host_sim/sample_scenes.hpp"
#include "tools/common/error.hpp"

using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

const Precision kCorePrecision{0x1p-52L, 1.5e-8L, 1e-12L, 1e-12L};

Wide search(const OraclePiece& a, const OraclePiece& b, const WideVec& x,
            const WideRotation& r = {}) {
  return search_pair(a, b, {r, x}, 0.3L, kCorePrecision).reference_m;
}

/// In a box of these lengths about the origin.
WideVec within(Random& random, Wide x, Wide y, Wide z) {
  return {x * (random.wide() - 0.5L), y * (random.wide() - 0.5L), z * (random.wide() - 0.5L)};
}

WideRotation random_rotation(Random& random) {
  return rotation_of(random.wide() - 0.5L, random.wide() - 0.5L, random.wide() - 0.5L,
                     random.wide());
}

}  // namespace

TEST_SUITE("host_sim.oracle") {
  TEST_CASE("axis-aligned boxes: D_near is the largest gap of the six faces") {
    const OraclePiece a = piece_of(box(0.02, 0.03, 0.04)), b = piece_of(box(0.1, 0.06, 0.05));
    Random random(1);
    for (int i = 0; i < 500; ++i) {
      const WideVec x = within(random, 0.4L, 0.4L, 0.4L);
      const Wide expected =
          std::max({std::abs(x.x) - 0.12L, std::abs(x.y) - 0.09L, std::abs(x.z) - 0.09L});
      CHECK(std::abs(search(a, b, x) - expected) < 1e-17L);
    }
  }

  TEST_CASE("concentric boxes: depth is the smallest sum of half extents") {
    const Wide depth =
        search(piece_of(box(0.01, 0.02, 0.03)), piece_of(box(0.1, 0.2, 0.05)), {0, 0, 0});
    CHECK(std::abs(depth + 0.08L) < 1e-17L);
  }

  TEST_CASE("box turned by 45 degrees over a box: an edge of A is nearest to a face of B") {
    const OraclePiece a = piece_of(box(0.03, 0.03, 0.03)), b = piece_of(box(0.1, 0.1, 0.1));
    const Wide h = std::sqrt(0.5L);
    WideRotation r;  // about y
    r.row[0] = {h, 0, h};
    r.row[2] = {-h, 0, h};
    for (const Wide z : {0.16L, 0.14L, 0.12L}) {
      CHECK(std::abs(search(a, b, {0, 0, z}, r) - (z - 0.1L - 0.06L * h)) < 1e-17L);
    }
  }

  TEST_CASE("two crossed edges: the normal is their cross product") {
    // A turned by 45 degrees about x stands on an edge along x; B turned by 45 degrees about y has
    // an edge along y on top.
    GoldenBody turned = box(0.05, 0.05, 0.05);
    const Wide h = std::sqrt(0.5L);
    for (WideVec& v : turned.vertices) v = {h * (v.x + v.z), v.y, h * (v.z - v.x)};
    const OraclePiece b = piece_of(turned), a = piece_of(box(0.05, 0.05, 0.05));
    WideRotation r;
    r.row[1] = {0, h, -h};
    r.row[2] = {0, h, h};
    const Wide reach = 2 * 0.05L * std::sqrt(2.0L);
    for (const Wide gap : {0.001L, 0.0L, -0.001L}) {
      CHECK(std::abs(search(a, b, {0.002L, 0.003L, reach + gap}, r) - gap) < 1e-17L);
    }
  }

  TEST_CASE("inside, the depth is the distance to the nearest facet along every direction tried") {
    // D_near inside is the largest s(n) over all unit n: no random direction may exceed it.
    const OraclePiece a = piece_of(tetrahedron()), b = piece_of(prism(7, 0.08, 0.03));
    Random random(7);
    for (int i = 0; i < 60; ++i) {
      const WideRotation r = random_rotation(random);
      const WideVec x = within(random, 0.02L, 0.02L, 0.05L);
      const Wide depth = search(a, b, x, r);
      REQUIRE(depth < 0);
      for (int k = 0; k < 200; ++k) {
        const WideVec n = unit(within(random, 1, 1, 1));
        Wide low = 1e9L, high = -1e9L;
        for (const WideVec& v : a.vertices) low = std::min(low, dot(n, x + r * v));
        for (const WideVec& v : b.vertices) high = std::max(high, dot(n, v));
        CHECK(low - high <= depth + 1e-17L);
      }
    }
  }

  TEST_CASE("all_nodes and search_pair agree at generic poses") {
    const OraclePiece a = piece_of(tetrahedron()), b = piece_of(box(0.1, 0.06, 0.05));
    Random random(3);
    for (int i = 0; i < 200; ++i) {
      const WideRotation r = random_rotation(random);
      const WideVec x = within(random, 0.3L, 0.3L, 0.3L);
      const std::vector<NodeValue> nodes = all_nodes(a, b, {r, x});
      CHECK(nodes.size() == 128);
      Wide largest = -1;
      int applicable = 0;
      for (const NodeValue& n : nodes) {
        if (n.violation_m > 1e-16L) continue;
        largest = std::max(largest, n.depth_m);
        ++applicable;
      }
      CHECK(applicable >= 19);  // rt_core/METHOD.md section 2: 19 to 22 at a generic orientation
      CHECK(applicable <= 22);
      const PairTruth truth = search_pair(a, b, {r, x}, 0.3L, kCorePrecision);
      CHECK(truth.lower_m - 1e-17L <= largest);
      CHECK(largest <= truth.upper_m + 1e-17L);
    }
  }

  TEST_CASE("an open surface is refused") {
    GoldenBody open = box(1, 1, 1);
    open.loops.pop_back();
    CHECK_THROWS_AS(static_cast<void>(piece_of(open)), haptic::tools::InputError);
  }

  TEST_CASE("the account counts wrong verdicts, wrong depths and their longest run") {
    PairVerdict contact;
    contact.truth = {-0.001L, -0.001L, -0.001L};
    contact.tolerance_m = 1e-13L;
    PairVerdict apart = contact;
    apart.truth = {0.002L, 0.002L, 0.003L};
    const PairVerdict both[] = {contact, apart};
    TrackCheck check;
    const auto add = [&](double first, double second) {
      const PairValue values[] = {{first}, {second}};
      check.add(check.totals().ticks, both, values);
    };
    add(-0.001, 0.0025);  // right: anywhere within the range
    add(0.001, 0.0025);   // missed collision
    add(-0.001, -0.001);  // false collision
    add(-0.0011, 0.002);  // wrong depth only
    add(-0.001, 0.002);
    add(std::nan(""), 0.002);
    const CheckTotals& t = check.totals();
    CHECK(t.wrong_verdict_pairs == 3);
    CHECK(t.missed_collision_pairs == 2);
    CHECK(t.false_collision_pairs == 1);
    CHECK(t.wrong_depth_pairs == 4);
    CHECK(t.longest_wrong_run == 3);
    CHECK(t.longest_wrong_verdict_run == 2);
    CHECK(t.first_wrong_tick == 1);
    CHECK(t.widened_pairs == 6);
    CHECK_FALSE(t.passed());
    TrackCheck far;  // a bound counts by its verdict alone
    const PairValue bound[] = {{-0.001}, {0.5, false}}, lie[] = {{-0.001}, {-0.5, false}};
    far.add(0, both, bound);
    CHECK(far.totals().passed());
    CHECK(far.totals().far_pairs == 1);
    far.add(1, both, lie);
    CHECK(far.totals().wrong_verdict_pairs == 1);
    CHECK(far.totals().wrong_depth_pairs == 0);
    TrackCheck deep;  // a colliding pair's bound lies at the depth or below it
    const PairValue below[] = {{-0.002, false}, {0.002}}, above[] = {{-0.0005, false}, {0.002}};
    deep.add(0, both, below);
    CHECK(deep.totals().passed());
    CHECK(deep.totals().bounded_pairs == 1);
    deep.add(1, both, above);
    CHECK(deep.totals().wrong_verdict_pairs == 0);
    CHECK(deep.totals().wrong_depth_pairs == 1);
  }
}
