// SPDX-License-Identifier: Apache-2.0
#pragma once
/// How long a cycle of a servo bus takes, one write and one read: as computed, and as counted.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace haptic::tools {

/// A byte on the line: start bit, 8 data bits, stop bit.
[[nodiscard]] constexpr std::int64_t line_time_ns(std::size_t bytes, std::uint32_t baud) noexcept {
  return static_cast<std::int64_t>(bytes) * 10 * 1'000'000'000 / std::max<std::uint32_t>(baud, 1);
}

/// Periods that a bridge runs at. A frame of USB takes 1 ms of each; half of a servo's watchdog is
/// the longest.
inline constexpr std::array<std::int64_t, 7> kBusPeriods_ns = {
    2'000'000, 2'500'000, 3'000'000, 4'000'000, 5'000'000, 8'000'000, 10'000'000};

/// The shortest period that a cycle of `cycle_ns` fits into with a fifth to spare. 0: none does.
[[nodiscard]] constexpr std::int64_t period_for(std::int64_t cycle_ns) noexcept {
  for (const std::int64_t period : kBusPeriods_ns) {
    if (cycle_ns + cycle_ns / 5 <= period) return period;
  }
  return 0;
}

/// Cycles of a bus since it was opened.
struct CycleCounts {
  std::uint64_t answered = 0;     ///< whole and right
  std::uint64_t missed = 0;       ///< late, cut short, or with a wrong check sum
  std::uint64_t wrong_check = 0;  ///< of those, with a wrong check sum
  std::uint64_t cuts = 0;         ///< the watchdog of a servo had cut, and was acknowledged
  std::int64_t longest_ns = 0;    ///< from the write to the last byte of the answer
  std::int64_t sum_ns = 0;

  void count(std::int64_t duration_ns) noexcept {
    ++answered;
    sum_ns += duration_ns;
    longest_ns = std::max(longest_ns, duration_ns);
  }
  [[nodiscard]] std::int64_t mean_ns() const noexcept {
    return answered == 0 ? 0 : sum_ns / static_cast<std::int64_t>(answered);
  }
};

}  // namespace haptic::tools
