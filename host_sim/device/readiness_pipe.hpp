// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A descriptor whose poll events this process decides: the write end of a pipe of one page. Full:
/// no event; drained: POLLOUT; read end closed: POLLERR. poll itself stays the kernel's own, and a
/// usbfs descriptor says the same with the same events: a URB can be reaped, the device is gone.

#include <cstddef>
#include <vector>

namespace haptic::sim {

/// Not thread-safe.
class ReadinessPipe {
 public:
  /// Without an event. @throws std::system_error when the kernel refuses.
  ReadinessPipe();
  ~ReadinessPipe();
  ReadinessPipe(const ReadinessPipe&) = delete;
  ReadinessPipe& operator=(const ReadinessPipe&) = delete;

  /// What to poll; closed by the destructor.
  [[nodiscard]] int descriptor() const { return write_end_; }
  /// POLLOUT or not. Cost: one system call when it changes.
  void show_ready(bool ready);
  /// POLLERR from now on.
  void hang_up();

 private:
  int read_end_ = -1, write_end_ = -1;
  bool ready_ = true;
  std::vector<std::byte> page_;
};

}  // namespace haptic::sim
