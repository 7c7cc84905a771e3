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

void publish_state(DeviceMailbox& mailbox, const DeviceState& state, bool wake) noexcept {
  mailbox.state.publish(state);
  // Release: who sees the count grown sees the state.
  mailbox.states_published.fetch_add(1, std::memory_order_release);
  // Not FUTEX_PRIVATE: the sleeper may be another process.
  if (wake) syscall(SYS_futex, &mailbox.states_published, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
}

std::uint32_t wait_for_state(DeviceMailbox& mailbox, std::uint32_t seen,
                             std::int64_t deadline_ns) noexcept {
  const std::uint32_t now = mailbox.states_published.load(std::memory_order_acquire);
  if (now != seen) return now;
  timespec deadline{};
  deadline.tv_sec = deadline_ns / kNsPerSecond;
  deadline.tv_nsec = deadline_ns % kNsPerSecond;
  // FUTEX_WAIT_BITSET takes an absolute time of the monotonic clock.
  syscall(SYS_futex, &mailbox.states_published, FUTEX_WAIT_BITSET, seen, &deadline, nullptr,
          FUTEX_BITSET_MATCH_ANY);
  return mailbox.states_published.load(std::memory_order_acquire);
}

}  // namespace haptic::hal
