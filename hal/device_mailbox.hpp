// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What servo and device side share: the two triple buffers, and a count of reports that a
/// report-clocked loop sleeps on. Plain memory, so that it may be shared by two processes.

#include <atomic>
#include <cstdint>

#include "rt_core/exchange/device_exchange.hpp"
#include "rt_core/exchange/latest_value.hpp"

namespace haptic::hal {

struct DeviceMailbox {
  LatestValue<DeviceState> state;      ///< written by the device side, read by the servo thread
  LatestValue<DeviceCommand> command;  ///< the reverse
  alignas(64) std::atomic<std::uint32_t> states_published{0};
};

/// Device side: publishes a state; with `wake`, also wakes a report-clocked loop (one system call).
void publish_state(DeviceMailbox& mailbox, const DeviceState& state, bool wake) noexcept;

/// Servo side: sleeps until states_published differs from `seen` or the monotonic clock reaches
/// `deadline_ns`. Returns the count; spurious returns are possible.
std::uint32_t wait_for_state(DeviceMailbox& mailbox, std::uint32_t seen,
                             std::int64_t deadline_ns) noexcept;

}  // namespace haptic::hal
