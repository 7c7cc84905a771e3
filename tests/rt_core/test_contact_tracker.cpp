// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/shapes.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

tools::Body paper_tetrahedron() {
  return tetrahedron({0.05, 0, -0.03}, {-0.03, 0.04, -0.03}, {-0.03, -0.04, -0.03}, {0, 0, 0.06});
}
tools::Body paper_box() { return box({-0.06, -0.05, -0.04}, {0.06, 0.05, 0.04}); }

struct Sample {
  Point p;
  std::array<double, 4> q;
};

/// Smooth 1 kHz motion round and into an obstacle of about 0.1 m: sums of sines, up to `speed` m/s
/// and `turn` rad/s.
std::vector<Sample> smooth_motion(std::uint64_t seed, int ticks, double speed, double turn,
                                  double reach, double lift) {
  Random random(seed);
  double amplitude[6][3], frequency[6][3], phase[6][3];
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < 3; ++k) {
      frequency[i][k] = random.uniform(0.3, 2.0);
      const double limit = (i < 3 ? speed : turn) / (3.0 * 2 * 3.14159 * frequency[i][k]);
      amplitude[i][k] = std::min(limit, i < 3 ? reach : 1.5);
      phase[i][k] = random.uniform(0, 6.28);
    }
  }
  std::vector<Sample> motion;
  for (int t = 0; t < ticks; ++t) {
    double v[6] = {};
    for (int i = 0; i < 6; ++i) {
      for (int k = 0; k < 3; ++k)
        v[i] += amplitude[i][k] * std::sin(6.2831853 * frequency[i][k] * t * 1e-3 + phase[i][k]);
    }
    const double angle = std::sqrt(v[3] * v[3] + v[4] * v[4] + v[5] * v[5]) + 1e-300;
    const double s = std::sin(angle / 2) / angle;
    motion.push_back(
        {{v[0], v[1], v[2] + lift}, {std::cos(angle / 2), s * v[3], s * v[4], s * v[5]}});
  }
  return motion;
}

struct Comparison {
  int ticks = 0, wrong_d = 0, wrong_near = 0, wrong_verdict = 0, relocalised = 0;
  std::uint32_t most_evaluated = 0;  ///< in ticks that were not re-localised
  int contacts = 0;
};

/// Tracks a motion and compares every tick with a first tick of a second core, which searches
/// exhaustively.
Comparison compare(const tools::Body& a, const tools::Body& b, const std::vector<Sample>& motion) {
  LoadedScene tracked(scene_of(a, {b})), fresh(scene_of(a, {b}));
  Comparison c;
  std::uint32_t last_near = 0;
  const double tolerance = HAPTIC_REAL_IS_FLOAT ? 2e-6 : 1e-12;
  for (const Sample& s : motion) {
    const StepResult r = tracked.step(s.p, s.q);
    fresh.core->reset();
    const StepResult truth = fresh.step(s.p, s.q);
    c.ticks += 1;
    c.contacts += r.d_near_m <= 0 ? 1 : 0;
    c.wrong_d += std::abs(static_cast<double>(r.d_near_m - truth.d_near_m)) > tolerance ? 1 : 0;
    c.wrong_verdict += (r.d_near_m <= 0) != (truth.d_near_m <= 0) &&
                               std::abs(static_cast<double>(truth.d_near_m)) > tolerance
                           ? 1
                           : 0;
    const bool same_near =
        std::ranges::equal(tracked.core->pair_near_nodes(0), fresh.core->pair_near_nodes(0));
    c.wrong_near += same_near ? 0 : 1;
    const bool relocalised = (r.flags & kFlagRelocalised) != 0;
    c.relocalised += relocalised && c.ticks > 1 ? 1 : 0;
    // Near set: the neighbor subgraph is that of the last tick's, its own are added where ties are
    // crossed.
    if (!relocalised) {
      c.most_evaluated = std::max(c.most_evaluated,
                                  r.counters.nodes_evaluated - std::max(r.near_count, last_near));
    }
    last_near = r.near_count;
  }
  return c;
}

}  // namespace

TEST_SUITE("rt_core.contact_tracker") {
  TEST_CASE("at rest a wrong depth does not last: every node is looked at in turn") {
    const tools::Body needle = box({-0.05, -0.0015, -0.0015}, {0.05, 0.0015, 0.0015});
    LoadedScene tracked(scene_of(needle, {paper_box()})), fresh(scene_of(needle, {paper_box()}));
    Random random(8);
    int wrong_at_first = 0, wrong_at_rest = 0;
    for (int k = 0; k < 600; ++k) {
      const Point p = {random.uniform(-0.05, 0.05), random.uniform(-0.04, 0.04),
                       random.uniform(-0.03, 0.03)};
      const std::array<double, 4> q = random.rotation();
      fresh.core->reset();
      const double truth = static_cast<double>(fresh.step(p, q).d_near_m);
      const double tolerance = HAPTIC_REAL_IS_FLOAT ? 2e-6 : 1e-12;
      double d = static_cast<double>(tracked.step(p, q).d_near_m);
      wrong_at_first += std::abs(d - truth) > tolerance ? 1 : 0;
      for (int t = 0; t < 64; ++t) d = static_cast<double>(tracked.step(p, q).d_near_m);
      wrong_at_rest += std::abs(d - truth) > tolerance ? 1 : 0;
    }
    CHECK(wrong_at_rest == 0);
    MESSAGE("wrong at the jump " << wrong_at_first << " of 600");
  }

  TEST_CASE("a body smaller than epsilon: the near set is cut, the force is not lost") {
    LoadedScene scene(scene_of(prism(40, 2e-4, 1e-4), {prism(40, 2e-4, 1e-4)}));
    Random random(12);
    int cut = 0;
    for (int k = 0; k < 200; ++k) {
      const StepResult r = scene.step(
          {random.uniform(-1e-4, 1e-4), random.uniform(-1e-4, 1e-4), random.uniform(-5e-5, 5e-5)},
          random.rotation());
      cut += (r.flags & kFlagNearSetCut) != 0 ? 1 : 0;
      CHECK(r.near_count > 0);
      if (r.d_near_m < 0) {
        const double force = static_cast<double>(r.wrench_w.force_w.norm());
        CHECK(std::abs(force + 1000.0 * static_cast<double>(r.d_near_m)) < 1e-6);
      }
    }
    CHECK(cut > 0);
  }

  TEST_CASE(
      "tetrahedron and box in smooth motion: verdict and depth of the exhaustive search, at most "
      "72 nodes") {
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
      const Comparison c = compare(paper_tetrahedron(), paper_box(),
                                   smooth_motion(seed, 6000, 0.2, 2.0, 0.06, 0.075));
      CHECK(c.wrong_verdict == 0);
      CHECK(c.wrong_d == 0);
      CHECK(c.wrong_near <= c.ticks / 1000);
      CHECK(c.contacts > 200);
      CHECK(c.relocalised <= c.ticks / 1000);
      CHECK(c.most_evaluated <= 72);
      MESSAGE("contacts " << c.contacts << ", re-localised " << c.relocalised << ", most nodes "
                          << c.most_evaluated);
    }
  }

  TEST_CASE("fast motion: the verdict stays right, lost tracks are re-localised") {
    const tools::Body needle = box({-0.05, -0.0015, -0.0015}, {0.05, 0.0015, 0.0015});
    const tools::Body plate = box({-0.05, -0.05, -0.001}, {0.05, 0.05, 0.001});
    const tools::Body bodies[] = {paper_tetrahedron(), paper_box(), prism(12, 0.04, 0.08), needle,
                                  plate};
    std::uint64_t seed = 10;
    for (const tools::Body& a : bodies) {
      const Comparison c =
          compare(a, paper_box(), smooth_motion(++seed, 4000, 1.0, 10.0, 0.06, 0.08));
      CHECK(c.wrong_verdict == 0);
      CHECK(c.wrong_d <= c.ticks / 100);
      MESSAGE("wrong D_near " << c.wrong_d << " of " << c.ticks << ", re-localised "
                              << c.relocalised);
    }
  }

  TEST_CASE("aligned bodies, rotation noise from 0 to 1e-8: ties do not lose the track") {
    Random random(77);
    for (const double noise : {0.0, 1e-16, 1e-12, 1e-8}) {
      std::vector<Sample> motion;
      for (int t = 0; t < 2000; ++t) {
        const double s = std::sin(t * 0.004), c = std::cos(t * 0.0031);
        motion.push_back({{0.05 * s, 0.04 * c, 0.0799 + 0.004 * std::sin(t * 0.01)},
                          {1, random.uniform(-noise, noise), random.uniform(-noise, noise),
                           random.uniform(-noise, noise)}});
      }
      for (const tools::Body& a : {paper_box(), prism(12, 0.04, 0.08)}) {
        const Comparison c = compare(a, paper_box(), motion);
        CHECK(c.wrong_verdict == 0);
        CHECK(c.wrong_d == 0);
        CHECK(c.relocalised <= 2);
      }
    }
  }

  TEST_CASE("jumps: an exhaustive search answers what the local set cannot") {
    Random random(5);
    std::vector<Sample> motion;
    for (int t = 0; t < 3000; ++t) {
      motion.push_back(
          {{random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1)},
           random.rotation()});
    }
    int relocalised = 0;
    for (const tools::Body& a : {paper_tetrahedron(), prism(24, 0.05, 0.004),
                                 box({-0.05, -0.0005, -0.0005}, {0.05, 0.0005, 0.0005})}) {
      const Comparison c = compare(a, prism(24, 0.05, 0.03), motion);
      CHECK(c.wrong_verdict == 0);
      relocalised += c.relocalised;
      MESSAGE("wrong D_near " << c.wrong_d << ", re-localised " << c.relocalised);
    }
    CHECK(relocalised > 0);
  }
}
