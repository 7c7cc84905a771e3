// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A bridge between run_device and a device that another process serves: the service that all
/// bridges have, in a process of its own that can be harmed as such.

#include <sys/types.h>

#include <string>

namespace haptic::sim {

/// Owner: a process of one thread, which forks it. The device may come later, and go and come.
class RelayBridge {
 public:
  /// @param listen  socket for the host; @param device  socket of the device that it stands for
  /// @throws std::system_error  no process
  RelayBridge(const std::string& listen, const std::string& device);
  ~RelayBridge();
  RelayBridge(const RelayBridge&) = delete;
  RelayBridge& operator=(const RelayBridge&) = delete;

  /// Its device takes nothing over until this is taken back, and goes on reporting.
  void be_deaf(bool deaf);
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  pid_t pid_ = -1;
};

}  // namespace haptic::sim
