// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "hal/realtime/interval_histogram.hpp"
#include "tests/hal/sorted_quantile.hpp"

using namespace haptic::hal;
using haptic::hal::test::kQuantiles;
using haptic::hal::test::sorted_quantile;

TEST_SUITE("hal.interval_histogram") {
  TEST_CASE("empty: all zero") {
    const auto h = std::make_unique<IntervalHistogram>();
    CHECK(h->count() == 0);
    CHECK(h->quantile_ns(0.5) == 0);
    CHECK(h->largest_ns() == 0);
    CHECK(h->shorter_than(IntervalHistogram::kDoublings) == 0);
  }

  TEST_CASE("one interval is found again: to the nanosecond below 1 us, else to a thousandth") {
    std::vector<std::int64_t> lengths = {0, 1, 1022, 1023};
    for (std::int64_t edge = 1024; edge <= IntervalHistogram::kMostNs; edge *= 2)
      lengths.insert(lengths.end(), {edge, edge + 1, edge + edge / 3, 2 * edge - 1});
    for (const std::int64_t length : lengths) {
      CAPTURE(length);
      const auto h = std::make_unique<IntervalHistogram>();
      h->add(length);
      h->add(IntervalHistogram::kMostNs);  // so that the largest does not say it
      const std::int64_t found = h->quantile_ns(0.5);
      CHECK(found >= length);
      CHECK(found <= length + length / IntervalHistogram::kExactNs);
      CHECK(h->overflows() == 0);
    }
  }

  TEST_CASE("negative counts as zero; beyond the bins: counted, and the largest is exact") {
    const auto h = std::make_unique<IntervalHistogram>();
    const std::int64_t beyond = IntervalHistogram::kMostNs + 1;
    for (const std::int64_t length : {std::int64_t{-7}, std::int64_t{5}, beyond, 3 * beyond})
      h->add(length);
    CHECK(h->count() == 4);
    CHECK(h->overflows() == 2);
    CHECK(h->sum_ns() == 5 + 4 * beyond);
    CHECK(h->largest_ns() == 3 * beyond);
    CHECK(h->quantile_ns(0.25) == 0);
    CHECK(h->quantile_ns(0.5) == 5);
    CHECK(h->quantile_ns(0.75) == 3 * beyond);
    CHECK(h->shorter_than(IntervalHistogram::kDoublings) == 2);
  }

  TEST_CASE("quantiles and counts against sorting them all") {
    constexpr unsigned kSeed = 20267;
    CAPTURE(kSeed);
    std::mt19937 random(kSeed);
    std::lognormal_distribution<double> length(std::log(30'000.0), 1.5);
    const auto h = std::make_unique<IntervalHistogram>();
    std::vector<std::int64_t> all;
    for (int k = 0; k < 20'000; ++k) {
      all.push_back(std::min(static_cast<std::int64_t>(length(random)),
                             std::int64_t{IntervalHistogram::kMostNs}));
      h->add(all.back());
    }
    std::sort(all.begin(), all.end());
    for (const double q : kQuantiles) {
      CAPTURE(q);
      const std::int64_t exact = sorted_quantile(all, q);
      CHECK(h->quantile_ns(q) >= exact);
      CHECK(h->quantile_ns(q) <= exact + exact / IntervalHistogram::kExactNs);
    }
    for (unsigned k = 0; k <= IntervalHistogram::kDoublings; ++k) {
      const auto first_longer =
          std::lower_bound(all.begin(), all.end(), IntervalHistogram::kExactNs << k);
      CHECK(h->shorter_than(k) == static_cast<std::uint64_t>(first_longer - all.begin()));
    }
  }
}
