// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/interval_histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace haptic::hal {
namespace {

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
  if (count_ == 0) return 0;
  const double share = std::clamp(q, 0.0, 1.0);
  const auto needed = std::max<std::uint64_t>(
      static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_))), 1);
  std::uint64_t seen = 0;
  for (std::size_t k = 0; k < kBins; ++k) {
    seen += bins_[k];
    if (seen >= needed) return std::min(last_of_bin(k), largest_ns_);
  }
  return largest_ns_;
}

}  // namespace haptic::hal
