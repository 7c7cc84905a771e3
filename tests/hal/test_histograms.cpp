// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/histograms.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <sstream>
#include <vector>

using namespace haptic::hal;

namespace {

constexpr double kQuantiles[] = {0.0, 0.001, 0.25, 0.5, 0.9, 0.99, 0.999, 1.0};

/// The least value that at least the share `q` of the ascending `values` keeps.
std::int64_t sorted_quantile(const std::vector<std::int64_t>& values, double q) {
  const double share = q * static_cast<double>(values.size());
  return values[static_cast<std::size_t>(std::max(std::ceil(share), 1.0)) - 1];
}

}  // namespace

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

TEST_SUITE("hal.wakeup_histogram") {
  TEST_CASE("add: bins of a microsecond, the rest counted beyond 10 ms") {
    const auto h = std::make_unique<WakeupHistogram>();
    CHECK(h->quantile_ns(0.5) == 0);
    CHECK(h->mean_ns() == 0);
    for (const std::int64_t late : {-5L, 999L, 1000L, 9'999'999L, 10'000'000L, 40'000'000L})
      h->add(late);
    CHECK(h->count() == 6);
    CHECK(h->bin(0) == 2);  // before the deadline is no latency
    CHECK(h->bin(1) == 1);
    CHECK(h->bin(9999) == 1);
    CHECK(h->overflows() == 2);
    CHECK(h->least_ns() == 0);
    CHECK(h->largest_ns() == 40'000'000);
    CHECK(h->mean_ns() == (0 + 999 + 1000 + 9'999'999 + 10'000'000 + 40'000'000) / 6);
    CHECK(h->quantile_ns(1.0) == 40'000'000);
    h->clear();
    CHECK(h->count() == 0);
    CHECK(h->largest_ns() == 0);
  }

  TEST_CASE("quantile_ns: at least that share kept it, within a microsecond of sorting them all") {
    constexpr unsigned kSeed = 20261;
    CAPTURE(kSeed);
    std::mt19937 random(kSeed);
    std::lognormal_distribution<double> latency(std::log(30'000.0), 1.0);
    const auto h = std::make_unique<WakeupHistogram>();
    std::vector<std::int64_t> all;
    for (int i = 0; i < 20'000; ++i) {
      all.push_back(static_cast<std::int64_t>(latency(random)));
      h->add(all.back());
    }
    std::sort(all.begin(), all.end());
    REQUIRE(all.back() < 10'000'000);
    for (const double q : kQuantiles) {
      CAPTURE(q);
      const std::int64_t exact = sorted_quantile(all, q);
      CHECK(h->quantile_ns(q) >= exact);
      CHECK(h->quantile_ns(q) <= exact + 1000);
    }
  }

  TEST_CASE("cyclictest_text: read back as its tools read it") {
    const auto h = std::make_unique<WakeupHistogram>();
    for (int i = 0; i < 123; ++i) h->add(1'500);
    h->add(3'000);
    h->add(250'700);
    const std::string text = cyclictest_text(*h, 5);
    CHECK(text ==
          "# Histogram\n"
          "000000 000000\n"
          "000001 000123\n"
          "000002 000000\n"
          "000003 000001\n"
          "000004 000000\n"
          "# Total: 000000124\n"
          "# Min Latencies: 00001\n"
          "# Avg Latencies: 00003\n"
          "# Max Latencies: 00250\n"
          "# Histogram Overflows: 00001\n"
          "# Histogram Overflow at cycle number:\n"
          "# Thread 0: # 00001 others\n");
    std::istringstream lines(cyclictest_text(*h));
    std::string line;
    std::size_t bins = 0;
    std::uint64_t sum = 0;
    while (std::getline(lines, line)) {
      if (line.starts_with('#')) continue;
      std::size_t us = 0;
      std::uint64_t count = 0;
      std::istringstream(line) >> us >> count;
      CHECK(us == bins);
      bins += 1;
      sum += count;
    }
    CHECK(bins == WakeupHistogram::kBins);
    CHECK(sum == h->count());
  }
}
