// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/histograms.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <span>

namespace haptic::hal {
namespace {

// The first bin up to which at least the share `q` (0 to 1) of `count` lies; the number of bins
// where it lies beyond them, or where there is nothing.
std::size_t bin_with_share(std::span<const std::uint64_t> bins, std::uint64_t count,
                           double q) noexcept {
  const double share = std::clamp(q, 0.0, 1.0) * static_cast<double>(count);
  const auto needed = std::max<std::uint64_t>(static_cast<std::uint64_t>(std::ceil(share)), 1);
  std::uint64_t seen = 0;
  for (std::size_t k = 0; k < bins.size(); ++k) {
    seen += bins[k];
    if (seen >= needed) return k;
  }
  return bins.size();
}

constexpr auto kExact = static_cast<std::uint64_t>(IntervalHistogram::kExactNs);
constexpr unsigned kExactBits = std::countr_zero(kExact);
static_assert(std::has_single_bit(kExact));

// Bin k of doubling d (1 and on) has 2^(d-1) values, from (1024 + k) 2^(d-1) on.
std::size_t bin_of(std::uint64_t ns) noexcept {
  if (ns < kExact) return static_cast<std::size_t>(ns);
  const auto doubling = static_cast<unsigned>(std::bit_width(ns)) - kExactBits;
  return static_cast<std::size_t>(doubling * kExact + (ns >> (doubling - 1)) - kExact);
}

std::int64_t last_of_bin(std::size_t bin) noexcept {
  const std::uint64_t doubling = bin / kExact;
  if (doubling == 0) return static_cast<std::int64_t>(bin);
  const std::uint64_t mantissa = kExact + bin % kExact;
  return static_cast<std::int64_t>(((mantissa + 1) << (doubling - 1)) - 1);
}

// printf of up to two numbers: the format is cyclictest's.
template <typename... Numbers>
void append(std::string& text, const char* format, Numbers... numbers) {
  char line[96];
  std::snprintf(line, sizeof line, format, static_cast<unsigned long long>(numbers)...);
  text += line;
}

}  // namespace

void IntervalHistogram::add(std::int64_t interval_ns) noexcept {
  const std::int64_t interval = std::max<std::int64_t>(interval_ns, 0);
  if (interval <= kMostNs) {
    bins_[bin_of(static_cast<std::uint64_t>(interval))] += 1;
  } else {
    overflows_ += 1;
  }
  count_ += 1;
  sum_ns_ += interval;
  largest_ns_ = std::max(largest_ns_, interval);
}

std::uint64_t IntervalHistogram::shorter_than(unsigned doublings) const noexcept {
  const std::size_t bins = kExact * (std::min(doublings, kDoublings) + 1);
  std::uint64_t sum = 0;
  for (std::size_t k = 0; k < bins; ++k) sum += bins_[k];
  return sum;
}

std::int64_t IntervalHistogram::quantile_ns(double q) const noexcept {
  const std::size_t bin = bin_with_share(bins_, count_, q);
  return bin < kBins ? std::min(last_of_bin(bin), largest_ns_) : largest_ns_;
}

void WakeupHistogram::add(std::int64_t late_ns) noexcept {
  const std::int64_t late = std::max<std::int64_t>(late_ns, 0);
  const auto bin = static_cast<std::uint64_t>(late / kBinNs);
  if (bin < kBins) {
    bins_[bin] += 1;
  } else {
    overflows_ += 1;
  }
  least_ns_ = count_ == 0 ? late : std::min(least_ns_, late);
  largest_ns_ = std::max(largest_ns_, late);
  sum_ns_ += late;
  count_ += 1;
}

std::int64_t WakeupHistogram::mean_ns() const noexcept {
  return count_ == 0 ? 0 : sum_ns_ / static_cast<std::int64_t>(count_);
}

std::int64_t WakeupHistogram::quantile_ns(double q) const noexcept {
  const std::size_t bin = bin_with_share(bins_, count_, q);
  return bin < kBins ? std::min(static_cast<std::int64_t>(bin + 1) * kBinNs, largest_ns_)
                     : largest_ns_;
}

std::string cyclictest_text(const WakeupHistogram& histogram, std::size_t bins) {
  const std::size_t shown = std::min(bins, WakeupHistogram::kBins);
  std::string text = "# Histogram\n";
  text.reserve(shown * 14 + 256);
  std::uint64_t within = 0;
  for (std::size_t us = 0; us < shown; ++us) {
    append(text, "%06llu %06llu\n", us, histogram.bin(us));
    within += histogram.bin(us);
  }
  append(text, "# Total: %09llu\n", within);
  append(text, "# Min Latencies: %05llu\n", histogram.least_ns() / 1000);
  append(text, "# Avg Latencies: %05llu\n", histogram.mean_ns() / 1000);
  append(text, "# Max Latencies: %05llu\n", histogram.largest_ns() / 1000);
  const std::uint64_t beyond = histogram.count() - within;
  append(text, "# Histogram Overflows: %05llu\n", beyond);
  text += "# Histogram Overflow at cycle number:\n# Thread 0:";
  if (beyond > 0) append(text, " # %05llu others", beyond);  // which ticks they were is not kept
  text += "\n";
  return text;
}

}  // namespace haptic::hal
