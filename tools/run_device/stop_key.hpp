// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The emergency stop of the operator at the terminal: one key, without Enter. It never waits, and
/// a terminal that is gone, in the background or none at all is no key pressed.

#include <termios.h>

#include <string>

namespace haptic::tools {

/// Owner: the thread that asks. While it exists the terminal gives keys one by one and does not
/// echo them; Ctrl-C and Ctrl-Z are the terminal's as before.
class StopKey {
 public:
  /// @param path  the process's own terminal, or another (tests)
  explicit StopKey(const std::string& path = "/dev/tty");
  ~StopKey();
  StopKey(const StopKey&) = delete;
  StopKey& operator=(const StopKey&) = delete;

  /// True if space, `e` or `E` was pressed since the last call. A few system calls.
  [[nodiscard]] bool pressed() noexcept;
  [[nodiscard]] bool has_terminal() const noexcept { return terminal_ >= 0; }

 private:
  [[nodiscard]] bool is_ours() const noexcept;
  void take_over() noexcept;
  void drop() noexcept;

  int terminal_ = -1;
  bool changed_ = false;  ///< before_ is to be put back
  termios before_{};
};

}  // namespace haptic::tools
