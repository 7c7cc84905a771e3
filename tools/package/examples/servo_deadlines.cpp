// SPDX-License-Identifier: Apache-2.0
// Ten periods of a millisecond by the clock of the servo loop.
#include <cstdio>

#include "hal/clock/servo_clock.hpp"

int main() {
  constexpr std::int64_t kPeriod_ns = 1'000'000;
  haptic::hal::DeadlineSchedule schedule(haptic::hal::monotonic_ns(), kPeriod_ns);
  while (schedule.ticks() < 10) {
    if (haptic::hal::sleep_until(schedule.next_deadline_ns()) != 0) return 4;
    (void)schedule.advance(haptic::hal::monotonic_ns());
  }
  std::printf("%llu ticks\n", static_cast<unsigned long long>(schedule.ticks()));
  return 0;
}
