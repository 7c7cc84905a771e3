// SPDX-License-Identifier: Apache-2.0
// Scenes with marks: what is left out changes nothing that is felt, and bodies feel as if uncut.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "tests/support/counter_bounds.hpp"
#include "tests/support/cut_bodies.hpp"
#include "tests/support/pair_bench.hpp"
#include "tests/support/pruned_scenes.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr std::array<double, 4> kUpright = {0, 0, 0, 1};
constexpr double kEnvelope_rad = 0.5;

/// Nodes by scope of all pairs.
std::uint64_t nodes_of(const SceneView& view, NodeScope scope) {
  std::uint64_t sum = 0;
  for (std::uint32_t i = 0; i < view.pair_count(); ++i) {
    const PairView pair = view.pair(i);
    sum += live_counts(pair.marks, scope, pair.record, *pair.a.record, *pair.b.record).nodes;
  }
  return sum;
}

}  // namespace

TEST_SUITE("rt_core.pruned_scenes") {
  TEST_CASE("local search = full scan over the marked nodes") {
    Random random(81);
    tools::SceneDescription d = scene_of(block(), {plate_divisions()[0].body});
    const LoadedScene all(d);
    d.marks = all_marks(all.view);
    mark_cuts(all.view, 1, plate(), d.marks);
    d = with_envelope(d, kUpright, kEnvelope_rad);
    PairBench bench(d);
    const PairView& pair = bench.pair();
    const auto count = [&](NodeScope scope) {
      return live_counts(pair.marks, scope, pair.record, *pair.a.record, *pair.b.record).nodes;
    };
    REQUIRE(count(NodeScope::kReachable) < pair.record.node_count);
    REQUIRE(count(NodeScope::kLive) < count(NodeScope::kReachable));
    const double margin = (HAPTIC_REAL_IS_FLOAT ? 2e-5 : 1e-11) * 0.2;
    int wrong = 0, wrong_live = 0, missing = 0, extra = 0, near = 0, poses = 0;
    for (int k = 0; k < 4000; ++k) {
      const auto tilt = [&] { return k % 3 == 0 ? 0.0 : random.uniform(-0.2, 0.2); };
      // A turn of at most 0.2 about each axis stays within the envelope.
      bench.at(
          {random.uniform(-0.14, 0.04), random.uniform(-0.13, 0.13), random.uniform(-0.06, 0.03)},
          turned(tilt(), tilt(), tilt()));
      const NearResult found = bench.search();
      ++poses;
      wrong += std::abs(static_cast<double>(found.d_near_m - bench.exhaustive_d_near())) > margin;
      std::vector<std::uint32_t> doubtful, got;
      const std::vector<std::uint32_t> wanted = bench.exhaustive_near(
          found.d_near_m, (HAPTIC_REAL_IS_FLOAT ? 2e-5_r : 1e-9_r) * bench.pose().size_m, doubtful);
      for (const NearNode& n : bench.near()) got.push_back(n.node);
      std::ranges::sort(got);
      for (const std::uint32_t n : wanted) {
        missing += !std::ranges::binary_search(got, n) && !std::ranges::binary_search(doubtful, n);
      }
      for (const std::uint32_t n : got) {
        extra += !std::ranges::binary_search(wanted, n) && !std::ranges::binary_search(doubtful, n);
        CHECK(pair.marks.node(NodeScope::kLive, n));
      }
      near += static_cast<int>(got.size());
      const NearResult live = bench.search(NodeScope::kLive);
      const Real truth = bench.exhaustive_d_near(NodeScope::kLive);
      if (truth == kNoDepth || live.d_near_m == kNoDepth) {
        wrong_live += truth != live.d_near_m;
      } else {
        wrong_live += std::abs(static_cast<double>(live.d_near_m - truth)) > margin;
      }
    }
    CHECK(wrong == 0);
    CHECK(wrong_live == 0);
    CHECK(missing == 0);
    CHECK(extra == 0);
    CHECK(near > poses / 4);
  }

  TEST_CASE("within the envelope: the bits of wrench, verdict and D_near of the unpruned scene") {
    tools::SceneDescription d =
        scene_of(box({-0.01, -0.01, -0.03}, {0.01, 0.01, 0.03}),
                 {join({box({-0.03, -0.03, -0.04}, {-0.0105, 0.03, 0}),
                        box({0.0105, -0.03, -0.04}, {0.03, 0.03, 0}),
                        box({-0.0105, -0.03, -0.04}, {0.0105, -0.0105, 0}),
                        box({-0.0105, 0.0105, -0.04}, {0.0105, 0.03, 0})})});
    d.parameters.law = LawId::kPaper;
    d.graph_bytes = 0;
    LoadedScene all(d), pruned(with_envelope(d, kUpright, kEnvelope_rad));
    CHECK(nodes_of(pruned.view, NodeScope::kReachable) < nodes_of(all.view, NodeScope::kReachable));
    CHECK(pruned.view.header().capacity.state_bytes < all.view.header().capacity.state_bytes);
    Random random(82);
    int contacts = 0;
    for (int t = 0; t < 4000; ++t) {
      const double tilt = t % 2 == 0 ? 0.0 : 0.03;
      const double s = 0.003 * t;
      const Point p = {0.0008 * std::sin(3 * s), 0.0008 * std::cos(2 * s),
                       0.015 + 0.016 * std::sin(s)};
      const auto q = turned(tilt * std::sin(5 * s), tilt * std::cos(4 * s), 0.02 * std::sin(s));
      const StepResult a = all.step(p, q), b = pruned.step(p, q);
      REQUIRE(std::memcmp(&a.wrench_w, &b.wrench_w, sizeof a.wrench_w) == 0);
      REQUIRE(a.d_near_m == b.d_near_m);
      REQUIRE((b.flags & kFlagOutsideEnvelope) == 0);
      for (std::uint32_t i = 0; i < all.core->pair_count(); ++i) {
        REQUIRE(all.core->pair_report(i).verdict == pruned.core->pair_report(i).verdict);
      }
      contacts += a.d_near_m <= 0 ? 1 : 0;
    }
    CHECK(contacts > 200);
  }

  TEST_CASE("hidden nodes: verdicts and free distances of the unpruned scene at every pose") {
    for (const Division& division : plate_divisions()) {
      CAPTURE(division.name);
      tools::SceneDescription open = cut_scene(nullptr, &division.body, LawId::kPaper);
      LoadedScene pruned(open);
      open.marks.clear();
      LoadedScene all(open);
      Random random(83);
      int free = 0, hit = 0;
      for (int t = 0; t < 3000; ++t) {
        const Point p = {random.uniform(-0.16, 0.16), random.uniform(-0.16, 0.16),
                         random.uniform(-0.09, 0.06)};
        const auto q = random.rotation();
        all.step(p, q);
        const StepResult r = pruned.step(p, q);
        CHECK((r.flags & kFlagInexact) == 0);
        for (std::uint32_t i = 0; i < all.core->pair_count(); ++i) {
          const PairReport a = all.core->pair_report(i), b = pruned.core->pair_report(i);
          REQUIRE(a.verdict == b.verdict);
          if (a.verdict == Verdict::kSeparated) {
            REQUIRE(a.d_near_m == b.d_near_m);
            ++free;
          } else {
            REQUIRE(b.d_near_m <= a.d_near_m + 1e-12_r);  // measured to exposed faces alone
            ++hit;
          }
        }
      }
      CHECK(free > 1000);
      CHECK(hit > 1000);
    }
  }

  TEST_CASE("counters stay within the bounds of a pruned scene, jumps included") {
    const tools::Body four = plate_divisions()[1].body;
    LoadedScene scene(cut_scene(nullptr, &four, LawId::kPaper));
    const SceneCapacity& c = scene.view.header().capacity;
    Random random(84);
    for (int t = 0; t < 3000; ++t) {
      const StepResult r = scene.step(
          {random.uniform(-0.12, 0.12), random.uniform(-0.12, 0.12), random.uniform(-0.06, 0.03)},
          random.rotation());
      CHECK(over_bound(r.counters, c) == "");
    }
  }

  TEST_CASE("a pair with no exposed node makes no force") {
    tools::SceneDescription d = scene_of(block(), {plate()});
    d.parameters.law = LawId::kPaper;
    const LoadedScene all(d);
    d.marks = all_marks(all.view);
    d.marks[0].exposed.assign(d.marks[0].exposed.size(), false);
    LoadedScene scene(d);
    const StepResult r = scene.step({0, 0, 0.019});
    CHECK(scene.core->pair_report(0).verdict == Verdict::kColliding);
    CHECK(r.wrench_w.force_w == Vec3::Zero());
    CHECK(r.counters.near_nodes == 0);
    CHECK(scene.step({0, 0, 0.0215}).d_near_m > 0.001_r);
  }

  TEST_CASE("a workspace that keeps pieces apart leaves their pairs out") {
    tools::SceneDescription d = scene_of(block(), {join({plate(), box({0.5, 0, 0}, {0.6, 1, 1})})});
    const LoadedScene all(d);
    d.marks = all_marks(all.view);
    d.marks[1].reachable.assign(d.marks[1].reachable.size(), false);
    d.workspace = tools::WorkspaceBox{{-0.1, -0.1, 0}, {0.1, 0.1, 0.1}};
    LoadedScene scene(d);
    CHECK(scene.view.pair_count() == 1);
    CHECK(scene.step({0, 0, 0.019}).wrench_w.force_w[2] > 0.5_r);
    d.marks[0].reachable.assign(d.marks[0].reachable.size(), false);
    CHECK_THROWS(tools::write_scene(d));
  }
}
