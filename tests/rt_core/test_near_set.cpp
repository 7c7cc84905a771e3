// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "tests/support/pair_bench.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

tools::Body paper_tetrahedron() {
  return tetrahedron({0.05, 0, -0.03}, {-0.03, 0.04, -0.03}, {-0.03, -0.04, -0.03}, {0, 0, 0.06});
}
tools::Body paper_box() { return box({-0.06, -0.05, -0.04}, {0.06, 0.05, 0.04}); }
tools::Body needle() { return box({-0.05, -0.0015, -0.0015}, {0.05, 0.0015, 0.0015}); }
tools::Body plate() { return box({-0.05, -0.05, -0.001}, {0.05, 0.05, 0.001}); }

struct Comparison {
  int poses = 0, wrong_d = 0, missing = 0, extra = 0, contacts = 0;
  double largest_error_m = 0;
  std::uint32_t most_features = 0, most_edge_pairs = 0, most_near = 0;
};

/// One search against the brute force at the bench's pose.
void compare(PairBench& bench, Comparison& c) {
  const NearResult found = bench.search();
  const Real truth = bench.exhaustive_d_near();
  const double size = static_cast<double>(bench.pose().size_m);
  const double error = std::abs(static_cast<double>(found.d_near_m - truth));
  c.poses += 1;
  c.contacts += truth <= 0 ? 1 : 0;
  c.largest_error_m = std::max(c.largest_error_m, error);
  c.wrong_d += error > (HAPTIC_REAL_IS_FLOAT ? 2e-5 : 1e-11) * size ? 1 : 0;
  c.most_features = std::max(c.most_features, found.feature_evaluations);
  c.most_edge_pairs = std::max(c.most_edge_pairs, found.edge_pairs);
  c.most_near = std::max(c.most_near, static_cast<std::uint32_t>(bench.near().size()));
  std::vector<std::uint32_t> doubtful;
  const std::vector<std::uint32_t> wanted = bench.exhaustive_near(
      found.d_near_m, (HAPTIC_REAL_IS_FLOAT ? 2e-5_r : 1e-9_r) * bench.pose().size_m, doubtful);
  std::vector<std::uint32_t> got;
  for (const NearNode& n : bench.near()) got.push_back(n.node);
  std::ranges::sort(got);
  const auto difference = [&](const auto& l, const auto& r) {
    int count = 0;
    for (const std::uint32_t node : l) {
      const bool excused = std::ranges::binary_search(doubtful, node);
      count += !std::ranges::binary_search(r, node) && !excused ? 1 : 0;
    }
    return count;
  };
  c.missing += difference(wanted, got);
  c.extra += difference(got, wanted);
  CHECK(std::ranges::adjacent_find(got) == got.end());
}

void report(const Comparison& c) {
  CHECK(c.wrong_d == 0);
  CHECK(c.missing == 0);
  CHECK(c.extra == 0);
  MESSAGE(c.poses << " poses, " << c.contacts << " contacts, largest error " << c.largest_error_m
                  << " m, most features " << c.most_features << ", edge pairs " << c.most_edge_pairs
                  << ", near nodes " << c.most_near);
}

}  // namespace

TEST_SUITE("rt_core.near_set") {
  TEST_CASE("after jumps, with keys of any age: D_near and the near set of the brute force") {
    Random random(5);
    for (const tools::Body& a :
         {paper_tetrahedron(), paper_box(), prism(12, 0.04, 0.08), needle(), plate()}) {
      for (const tools::Body& b : {paper_box(), plate()}) {
        PairBench bench(a, b);
        Comparison c;
        for (int k = 0; k < 400; ++k) {
          bench.at(
              {random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1)},
              random.rotation());
          if (k % 7 == 0) bench.reset();
          compare(bench, c);
        }
        report(c);
      }
    }
  }

  TEST_CASE("sliding in face-face contact with tilts from 0 to 1e-3 rad") {
    Random random(6);
    for (const double epsilon : {1e-4, 5e-4}) {
      for (const tools::Body& a : {paper_box(), prism(12, 0.04, 0.08)}) {
        PairBench bench(a, paper_box(), epsilon);
        Comparison c;
        for (int k = 0; k < 1500; ++k) {
          const double tilt = k % 5 == 0 ? 0 : std::pow(10.0, random.uniform(-10, -3));
          const double s = k * 1e-3;
          bench.at(
              {0.05 * std::sin(3 * s), 0.05 * std::cos(2 * s), 0.0799 + 2e-4 * std::sin(9 * s)},
              {1, tilt * random.uniform(-1, 1), tilt * random.uniform(-1, 1), 0.2 * s});
          compare(bench, c);
        }
        report(c);
        CHECK(c.most_near >= 8);
      }
    }
  }

  // Between 1e-12 and 1e-8 rad the brute force in this precision is no judge: it leaves edges out
  // that are that close to parallel.
  TEST_CASE("edges and corners close together, aligned with noise from 0 to 1e-4 rad") {
    Random random(7);
    for (const double noise : HAPTIC_REAL_IS_FLOAT ? std::vector<double>{0.0, 1e-16}
                                                   : std::vector<double>{0.0, 1e-16, 1e-6, 1e-4}) {
      PairBench bench(paper_box(), paper_box());
      Comparison c;
      for (int k = 0; k < 600; ++k) {
        const auto near = [&](double at) {
          return at * (k % 2 == 0 ? 1 : -1) + random.uniform(-2e-4, 2e-4);
        };
        bench.at({near(0.12), near(0.1), near(0.08)},
                 {1, random.uniform(-noise, noise), random.uniform(-noise, noise),
                  random.uniform(-noise, noise)});
        compare(bench, c);
      }
      report(c);
    }
  }

  TEST_CASE("a slow slide looks at few features, and the bounds say so") {
    PairBench bench(prism(40, 0.04, 0.05), paper_box());
    std::uint64_t features = 0;
    for (int k = 0; k < 2000; ++k) {
      const double s = k * 1e-3;
      bench.at({0.02 * std::sin(s), 0.02 * std::cos(s), 0.0642},
               {1, 0.01, 0.2 * std::sin(s), 0.1 * s});
      const NearResult found = bench.search();
      CHECK(std::abs(static_cast<double>(found.d_near_m - bench.exhaustive_d_near())) <
            (HAPTIC_REAL_IS_FLOAT ? 2e-6 : 1e-12));
      if (k > 0) features += found.feature_evaluations;
    }
    CHECK(features < 2000u * 24u);  // of 42 + 120 and 6 + 12 features
    MESSAGE("features evaluated per tick: " << static_cast<double>(features) / 2000);
  }

  TEST_CASE("a lowered key is a lie that the brute force finds") {
    PairBench bench(paper_box(), paper_box());
    int wrong = 0;
    for (int k = 0; k < 200; ++k) {
      // Box A drifts from resting on the top of B to a place next to it: another face becomes the
      // nearest.
      const double s = k * 1e-4;
      bench.at({0.1185 + s, 0, 0.0797 - s}, {1, 0, 0, 0});
      if (k == 3) {
        for (const PieceKeys* piece : {&bench.bounds().a, &bench.bounds().b}) {
          for (const FeatureKeys* keys : {&piece->faces, &piece->edges}) {
            for (Real& key : keys->key) key = std::min(key, -1.0_r);
          }
        }
      }
      const NearResult found = bench.search();
      wrong += std::abs(static_cast<double>(found.d_near_m - bench.exhaustive_d_near())) > 1e-6;
    }
    CHECK(wrong > 0);
  }
}
