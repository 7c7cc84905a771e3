// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The bridge of a device: a program of its own, device_bridge, that a run starts, watches, starts
/// again when it has ended, and ends.

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tools/run_device/device_config.hpp"

namespace haptic::tools {

/// Owner: the thread that runs the session; nothing of it is on a real-time thread. When this
/// process ends, however that is, Linux tells the bridge, which takes the force away.
class BridgeProcess {
 public:
  /// Makes the folder of the socket, which nobody else can enter. Starts nothing.
  /// @throws OsError  no folder, or no device_bridge beside this program.
  BridgeProcess(const BridgeCall& call, int priority);
  ~BridgeProcess();
  BridgeProcess(const BridgeProcess&) = delete;
  BridgeProcess& operator=(const BridgeProcess&) = delete;

  /// @throws OsError  it cannot be started.
  void start();
  /// The lines that it has said since the last look, and that it has ended; one that has is started
  /// again, kAgain_ns after it was started last. Never waits.
  [[nodiscard]] std::vector<std::string> look();
  /// Asks it to take the force away and to end, and waits for that, five seconds at most.
  void stop() noexcept;

  [[nodiscard]] std::string socket_path() const { return (folder_ / "device").string(); }
  [[nodiscard]] pid_t pid() const { return pid_; }

  static constexpr std::int64_t kAgain_ns = 1'000'000'000;

 private:
  [[nodiscard]] int spawn();
  void hear(std::vector<std::string>& lines);
  [[nodiscard]] bool has_ended(std::string& how);
  void close_pipe() noexcept;

  BridgeCall call_;
  int priority_;
  std::filesystem::path program_, folder_;
  pid_t pid_ = -1;
  int said_ = -1;  ///< the end of a pipe from which its words come
  std::string rest_;
  std::int64_t started_ns_ = 0;
};

}  // namespace haptic::tools
