// SPDX-License-Identifier: Apache-2.0
#pragma once
/// When the servo loop wakes: absolute deadlines on the monotonic clock, each computed from the
/// last one, so that the phase is kept however late a tick was. Late ticks are counted, never
/// caught up.

#include <cstdint>

namespace haptic::hal {

/// Monotonic host time [ns]. A vDSO read; no system call on Linux with a usable time-stamp counter.
[[nodiscard]] std::int64_t monotonic_ns() noexcept;

/// For how long the machine has been suspended since it started [ns]: CLOCK_BOOTTIME, which goes on
/// meanwhile, against CLOCK_MONOTONIC, which does not. Never too long; too short only where the
/// thread was held up in each of three looks. vDSO reads.
[[nodiscard]] std::int64_t machine_slept_ns() noexcept;

/// Sleeps until `deadline_ns` of the monotonic clock (TIMER_ABSTIME); signals do not end the sleep
/// early.
/// @return 0, or the errno of clock_nanosleep.
int sleep_until(std::int64_t deadline_ns) noexcept;

/// Deadlines of a periodic loop. Pure arithmetic: give it the time, it sleeps nowhere.
class DeadlineSchedule {
 public:
  /// First deadline one period after `start_ns`. `period_ns` > 0.
  DeadlineSchedule(std::int64_t start_ns, std::int64_t period_ns) noexcept
      : next_ns_(start_ns + period_ns), period_ns_(period_ns) {}

  [[nodiscard]] std::int64_t next_deadline_ns() const noexcept { return next_ns_; }

  /// Call when awake at `now_ns`: moves to the first deadline of the same phase that is not past.
  /// @return how many whole periods were missed, 0 for a tick in time or late by less than a
  /// period.
  std::int64_t advance(std::int64_t now_ns) noexcept;

  [[nodiscard]] std::int64_t last_lateness_ns() const noexcept { return lateness_ns_; }
  [[nodiscard]] std::uint64_t ticks() const noexcept { return ticks_; }
  [[nodiscard]] std::uint64_t missed_periods() const noexcept { return missed_; }

 private:
  std::int64_t next_ns_;
  std::int64_t period_ns_;
  std::int64_t lateness_ns_ = 0;
  std::uint64_t ticks_ = 0;
  std::uint64_t missed_ = 0;
};

}  // namespace haptic::hal
