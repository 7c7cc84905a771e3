// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <sstream>
#include <vector>

#include "hal/realtime/wakeup_histogram.hpp"
#include "tests/hal/sorted_quantile.hpp"

using namespace haptic::hal;
using haptic::hal::test::kQuantiles;
using haptic::hal::test::sorted_quantile;

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
