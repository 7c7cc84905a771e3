// SPDX-License-Identifier: Apache-2.0
#include "hal/clock/servo_clock.hpp"

#include <algorithm>
#include <cerrno>
#include <ctime>

namespace haptic::hal {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

std::int64_t clock_now_ns(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * kNsPerSecond + now.tv_nsec;
}

}  // namespace

std::int64_t monotonic_ns() noexcept { return clock_now_ns(CLOCK_MONOTONIC); }

std::int64_t machine_slept_ns() noexcept {
  std::int64_t longest = 0;
  for (int look = 0; look < 3; ++look) {
    const std::int64_t since_boot = clock_now_ns(CLOCK_BOOTTIME);
    longest = std::max(longest, since_boot - clock_now_ns(CLOCK_MONOTONIC));
  }
  return longest;
}

int sleep_until(std::int64_t deadline_ns) noexcept {
  timespec deadline{};
  deadline.tv_sec = deadline_ns / kNsPerSecond;
  deadline.tv_nsec = deadline_ns % kNsPerSecond;
  int error = EINTR;
  while (error == EINTR)
    error = clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
  return error;
}

std::int64_t DeadlineSchedule::advance(std::int64_t now_ns) noexcept {
  lateness_ns_ = now_ns > next_ns_ ? now_ns - next_ns_ : 0;
  const std::int64_t missed = lateness_ns_ / period_ns_;
  next_ns_ += (missed + 1) * period_ns_;
  ticks_ += 1;
  missed_ += static_cast<std::uint64_t>(missed);
  return missed;
}

}  // namespace haptic::hal
