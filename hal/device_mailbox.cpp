// SPDX-License-Identifier: Apache-2.0
#include "hal/device_mailbox.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <climits>
#include <ctime>

namespace haptic::hal {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t),
              "the futex is the word itself");

}  // namespace

void DeviceSide::publish(const DeviceState& state, bool wake) noexcept {
  states_.publish(state);
  // Release: who sees the count grown sees the state.
  half_->published.store(++published_, std::memory_order_release);
  // Not FUTEX_PRIVATE: the sleeper may be another process.
  if (wake) syscall(SYS_futex, &half_->published, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
}

std::uint32_t ServoSide::wait_for_state(std::uint32_t seen,
                                        std::int64_t deadline_ns) const noexcept {
  const std::uint32_t now = states_published();
  if (now != seen) return now;
  timespec deadline{};
  deadline.tv_sec = deadline_ns / kNsPerSecond;
  deadline.tv_nsec = deadline_ns % kNsPerSecond;
  // FUTEX_WAIT_BITSET takes an absolute time of the monotonic clock.
  syscall(SYS_futex, &half_->published, FUTEX_WAIT_BITSET, seen, &deadline, nullptr,
          FUTEX_BITSET_MATCH_ANY);
  return states_published();
}

}  // namespace haptic::hal
