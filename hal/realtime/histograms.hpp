// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Durations in memory of a fixed size: to a thousandth of themselves (IntervalHistogram), or in
/// the whole microseconds of cyclictest (WakeupHistogram).

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace haptic::hal {

/// How long something took, time after time: exact below 1 us, to a thousandth of itself up to 33
/// ms, so that two runs can be compared to nanoseconds; beyond that only a count.
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

  /// Interval that the share `q` (0 to 1) of all intervals did not exceed: the largest value of its
  /// bin, not above the largest of all; the largest where it lies beyond the bins; 0 where empty.
  [[nodiscard]] std::int64_t quantile_ns(double q) const noexcept;

 private:
  static constexpr std::size_t kBins = static_cast<std::size_t>(kExactNs) * (kDoublings + 1);

  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_ = 0, overflows_ = 0;
  std::int64_t sum_ns_ = 0, largest_ns_ = 0;
};

/// How late a loop woke, tick by tick: one bin per microsecond up to 10 ms, and beyond that only a
/// count and the largest.
/// Owner: the thread that adds; others read once it has ended. 80 kB, no heap.
class WakeupHistogram {
 public:
  static constexpr std::size_t kBins = 10'000;
  static constexpr std::int64_t kBinNs = 1'000;

  /// One wake-up, `late_ns` after its deadline; before it counts as 0. O(1), wait-free.
  void add(std::int64_t late_ns) noexcept;
  void clear() noexcept { *this = WakeupHistogram(); }

  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] std::uint64_t bin(std::size_t us) const noexcept { return bins_[us]; }
  [[nodiscard]] std::uint64_t overflows() const noexcept { return overflows_; }  ///< 10 ms or more
  [[nodiscard]] std::int64_t least_ns() const noexcept { return least_ns_; }     ///< 0 where empty
  [[nodiscard]] std::int64_t largest_ns() const noexcept { return largest_ns_; }
  [[nodiscard]] std::int64_t mean_ns() const noexcept;

  /// The lateness that at least the share `q` (0 to 1) of the wake-ups kept: upper edge of its bin,
  /// not above the largest; the largest where it lies beyond the bins; 0 where empty.
  [[nodiscard]] std::int64_t quantile_ns(double q) const noexcept;

 private:
  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_ = 0, overflows_ = 0;
  std::int64_t sum_ns_ = 0, least_ns_ = 0, largest_ns_ = 0;
};

/// As `cyclictest --histogram=BINS` of one thread writes it, so that its plotting tools read it:
/// "# Histogram", a line "000001 000123" per microsecond, "# Total:", "# Min Latencies:" and so on,
/// in whole microseconds rounded down. Wake-ups of `bins` microseconds or more (at most kBins) are
/// counted as overflows.
[[nodiscard]] std::string cyclictest_text(const WakeupHistogram& histogram,
                                          std::size_t bins = WakeupHistogram::kBins);

}  // namespace haptic::hal
