// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Memory that servo and device side share: two halves, each written by one side alone, so that
/// each may be a mapping of its own between two processes. A side counts in its own memory, and it
/// trusts nothing that the other side writes.

#include <atomic>
#include <cstdint>

#include "rt_core/exchange/device_exchange.hpp"
#include "rt_core/exchange/newest_record.hpp"

namespace haptic::hal {

/// Written by the device side; the servo side may have it read-only.
struct StateHalf {
  NewestRecord<DeviceState> newest;
  /// States so far: what a report-clocked loop sleeps on.
  alignas(64) std::atomic<std::uint32_t> published{0};
};

/// Written by the servo side.
struct CommandHalf {
  NewestRecord<DeviceCommand> newest;
};

/// Where the two halves are.
struct DeviceMailbox {
  StateHalf* states = nullptr;
  CommandHalf* commands = nullptr;
};

/// Both halves side by side, for two threads of one process.
struct MailboxMemory : DeviceMailbox {
  MailboxMemory() noexcept : DeviceMailbox{&state_half, &command_half} {}
  MailboxMemory(const MailboxMemory&) = delete;
  MailboxMemory& operator=(const MailboxMemory&) = delete;
  StateHalf state_half;
  CommandHalf command_half;
};

/// Owner: the thread that holds the device.
class DeviceSide {
 public:
  explicit DeviceSide(const DeviceMailbox& mailbox) noexcept
      : half_(mailbox.states),
        states_(mailbox.states->newest),
        commands_(mailbox.commands->newest) {}

  /// With `wake`, also wakes a report-clocked loop (one system call).
  void publish(const DeviceState& state, bool wake) noexcept;
  [[nodiscard]] const DeviceCommand& command() noexcept { return commands_.newest(); }

 private:
  StateHalf* half_;
  NewestWriter<DeviceState> states_;
  NewestReader<DeviceCommand> commands_;
  std::uint32_t published_ = 0;
};

/// Owner: the servo thread.
class ServoSide {
 public:
  explicit ServoSide(const DeviceMailbox& mailbox) noexcept
      : half_(mailbox.states),
        states_(mailbox.states->newest),
        commands_(mailbox.commands->newest) {}

  [[nodiscard]] const DeviceState& state(bool* is_new = nullptr) noexcept {
    return states_.newest(is_new);
  }
  void publish(const DeviceCommand& command) noexcept { commands_.publish(command); }

  [[nodiscard]] std::uint32_t states_published() const noexcept {
    return half_->published.load(std::memory_order_acquire);
  }
  /// Sleeps until states_published() differs from `seen` or the monotonic clock reaches
  /// `deadline_ns`. Returns the count; spurious returns are possible.
  [[nodiscard]] std::uint32_t wait_for_state(std::uint32_t seen,
                                             std::int64_t deadline_ns) const noexcept;

 private:
  const StateHalf* half_;
  NewestReader<DeviceState> states_;
  NewestWriter<DeviceCommand> commands_;
};

}  // namespace haptic::hal
