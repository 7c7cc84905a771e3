// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/wakeup_histogram.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace haptic::hal {
namespace {

// printf of up to two numbers: the format is cyclictest's.
template <typename... Numbers>
void append(std::string& text, const char* format, Numbers... numbers) {
  char line[96];
  std::snprintf(line, sizeof line, format, static_cast<unsigned long long>(numbers)...);
  text += line;
}

}  // namespace

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
  if (count_ == 0) return 0;
  const double share = std::clamp(q, 0.0, 1.0);
  const auto needed = std::max<std::uint64_t>(
      static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_))), 1);
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < kBins; ++i) {
    seen += bins_[i];
    if (seen >= needed) return std::min(static_cast<std::int64_t>(i + 1) * kBinNs, largest_ns_);
  }
  return largest_ns_;
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
