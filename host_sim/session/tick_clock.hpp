// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A clock for pieces of code of some hundred nanoseconds: fenced time stamp counter on x86-64,
/// steady_clock elsewhere.

#include <chrono>
#include <cstdint>

#if defined(__x86_64__)
#include <x86intrin.h>
#endif

namespace haptic::sim {

class TickClock {
 public:
  /// Measures the counter's rate against steady_clock and the cost of an empty measurement. Takes
  /// about 60 ms.
  TickClock();

  /// Current count. The fences keep the measured code between two calls.
  [[nodiscard]] static std::uint64_t now() {
#if defined(__x86_64__)
    _mm_lfence();
    unsigned processor = 0;
    const std::uint64_t count = __rdtscp(&processor);
    _mm_lfence();
    return count;
#else
    return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
#endif
  }

  /// Time between two counts less the cost of measuring, at least 0 [ns].
  [[nodiscard]] double ns_between(std::uint64_t begin, std::uint64_t end) const {
    const double counts = static_cast<double>(end - begin) - empty_counts_;
    return counts > 0 ? counts * ns_per_count_ : 0.0;
  }
  /// Time of one call, as between two counts.
  template <typename Call>
  [[nodiscard]] double ns_of(Call&& call) const {
    const std::uint64_t begin = now();
    call();
    const std::uint64_t end = now();
    return ns_between(begin, end);
  }
  [[nodiscard]] double empty_ns() const { return empty_counts_ * ns_per_count_; }
  [[nodiscard]] double ns_per_count() const { return ns_per_count_; }
  [[nodiscard]] static const char* name();

 private:
  double ns_per_count_ = 1.0, empty_counts_ = 0.0;
};

}  // namespace haptic::sim
