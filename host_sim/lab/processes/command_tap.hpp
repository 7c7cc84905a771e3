// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The commands of run_device as it publishes them in the memory that it shares with a device's
/// process, read there by a third process: what comes over the wire of the device behind can then
/// be dated without a word of those in between.

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

#include "host_sim/device/reference_model.hpp"

namespace haptic::sim {

struct TappedCommand {
  std::int64_t stamp_ns = 0;  ///< when it was made
  Load wrench;                ///< of drives that are on; else zero
};

/// Owner: one thread, which is not the one that it makes. Follows a new memory within 20 ms.
class CommandTap {
 public:
  CommandTap() = default;
  ~CommandTap() { (void)end(); }
  CommandTap(const CommandTap&) = delete;
  CommandTap& operator=(const CommandTap&) = delete;

  /// Begins with the memory of this process, which may come later.
  void begin(pid_t process);
  /// All so far, by the time when they were made; ends it.
  [[nodiscard]] std::vector<TappedCommand> end();

 private:
  void follow(pid_t process);

  std::vector<TappedCommand> commands_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace haptic::sim
