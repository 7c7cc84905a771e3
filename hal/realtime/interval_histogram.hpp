// SPDX-License-Identifier: Apache-2.0
#pragma once
/// How long something took, time after time, in memory of a fixed size: exact below 1 us, to a
/// thousandth of itself up to 33 ms, so that two runs can be compared to nanoseconds; beyond that
/// only a count. (WakeupHistogram has the whole microseconds of cyclictest.)

#include <array>
#include <cstddef>
#include <cstdint>

namespace haptic::hal {

/// Owner: the thread that adds; others read once it has ended. 130 kB, no heap, also in shared
/// memory. Trivially copyable.
class IntervalHistogram {
 public:
  static constexpr std::int64_t kExactNs = 1024;  ///< below it a bin for each nanosecond
  static constexpr unsigned kDoublings = 15;      ///< of it that have bins, 1024 for each
  static constexpr std::int64_t kMostNs = (kExactNs << kDoublings) - 1;

  /// One interval; a negative one counts as 0. O(1), wait-free.
  void add(std::int64_t interval_ns) noexcept;

  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] std::uint64_t overflows() const noexcept { return overflows_; }   ///< over kMostNs
  [[nodiscard]] std::int64_t sum_ns() const noexcept { return sum_ns_; }          ///< exact
  [[nodiscard]] std::int64_t largest_ns() const noexcept { return largest_ns_; }  ///< exact

  /// Intervals shorter than kExactNs << `doublings`, at most kDoublings.
  [[nodiscard]] std::uint64_t shorter_than(unsigned doublings) const noexcept;

  /// What at least the share `q` (0 to 1) of the intervals kept: the largest value of its bin, not
  /// above the largest of all; the largest where it lies beyond the bins; 0 where empty.
  [[nodiscard]] std::int64_t quantile_ns(double q) const noexcept;

 private:
  static constexpr std::size_t kBins = static_cast<std::size_t>(kExactNs) * (kDoublings + 1);

  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_ = 0, overflows_ = 0;
  std::int64_t sum_ns_ = 0, largest_ns_ = 0;
};

}  // namespace haptic::hal
