// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A process that outlives the guardian by one command. It holds a duplicate of the device's
/// descriptor and the zero command, knows nothing else, and sends it when the guardian has ended,
/// by SIGKILL too; and, for a device whose own watchdog would not notice, while the guardian is
/// frozen.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "hal/realtime/servo_process.hpp"
#include "hal/realtime/shared_memory.hpp"
#include "hal/zero_command.hpp"

namespace haptic::hal {

/// Longest silence of the guardian's thread that a device with a slower watchdog, or none, is left
/// alone with its last force. The guardian may be late by as much without being taken for frozen.
inline constexpr std::int64_t kLongestFrozen_ns = 100'000'000;

/// Owner: the thread that starts it, before any other; `hold`, `release` and `sent` are the link
/// thread's.
class ZeroKeeper final : public ZeroHolder {
 public:
  /// `device`: of this process, below kMostDevices.
  explicit ZeroKeeper(std::size_t device = 0) noexcept : device_(device) {}
  ~ZeroKeeper() override { stop(); }
  ZeroKeeper(const ZeroKeeper&) = delete;
  ZeroKeeper& operator=(const ZeroKeeper&) = delete;

  /// Forks it: a session of its own, so that no signal to the guardian's group reaches it. @return
  /// 0 or an errno.
  int start();
  /// It lets go of the device and ends; killed where it does not.
  void stop() noexcept;

  /// In another child: what belongs to the keeper is let go of.
  void leave() noexcept;

  void hold(const ZeroCommand& command) noexcept override;
  void release() noexcept override;
  [[nodiscard]] std::uint32_t sent() const noexcept override;
  /// Counter that the guardian's thread raises while it lives; null: not started.
  [[nodiscard]] std::atomic<std::uint32_t>* turns() noexcept;

  [[nodiscard]] int pid() const noexcept { return process_.pid(); }
  [[nodiscard]] int descriptor() const noexcept { return process_.descriptor(); }
  /// Says whether it has ended although nobody asked; a stopped keeper is killed and counts as
  /// ended.
  [[nodiscard]] ProcessEnd look() noexcept;

 private:
  /// Each side writes one of them, and the other has it read-only.
  struct FromGuardian {
    std::atomic<std::uint32_t> turns{0};
  };
  struct FromKeeper {
    std::atomic<std::uint32_t> sent{0}, looks{0};
  };
  [[nodiscard]] int keep(int socket) noexcept;

  std::size_t device_;
  std::optional<SharedMemory> down_, up_;
  FromGuardian* from_guardian_ = nullptr;
  FromKeeper* from_keeper_ = nullptr;
  ServoProcess process_;
  int socket_ = -1;
  std::uint32_t looks_ = 0;
  std::int64_t looked_ns_ = 0, still_ns_ = 0;
  ZeroCommand held_;  ///< also sent by this process, where it dies of a signal
};

}  // namespace haptic::hal
