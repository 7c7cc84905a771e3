// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/tick_clock.hpp"

#include <algorithm>

namespace haptic::sim {

TickClock::TickClock() {
  using Steady = std::chrono::steady_clock;
  const Steady::time_point steady_begin = Steady::now();
  const std::uint64_t begin = now();
  while (Steady::now() - steady_begin < std::chrono::milliseconds(50)) {
  }
  const std::uint64_t end = now();
  const std::chrono::duration<double, std::nano> elapsed = Steady::now() - steady_begin;
  ns_per_count_ = elapsed.count() / static_cast<double>(end - begin);
  std::uint64_t least = UINT64_MAX;
  for (int i = 0; i < 20000; ++i) {
    const std::uint64_t a = now();
    const std::uint64_t b = now();
    least = std::min(least, b - a);
  }
  empty_counts_ = static_cast<double>(least);
}

const char* TickClock::name() {
#if defined(__x86_64__)
  return "rdtscp between lfence";
#else
  return "steady_clock";
#endif
}

}  // namespace haptic::sim
