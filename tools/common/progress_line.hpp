// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The line that says what a program is doing while its user waits.

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <string>

namespace haptic::tools {

[[nodiscard]] inline bool is_terminal(std::FILE* file) { return ::isatty(::fileno(file)) == 1; }

/// One line on a terminal, from the second second on: nothing for quick scenes, and nothing in log
/// files unless asked for.
class ProgressLine {
 public:
  /// "mesh: step  40 %"; `fraction` in [0, 1].
  void show(const std::string& mesh, const char* step, double fraction) {
    if (!enabled_) return;
    const auto now = std::chrono::steady_clock::now();
    if (now - begin_ < std::chrono::seconds(1) || now - last_ < std::chrono::milliseconds(100)) {
      return;
    }
    last_ = now;
    shown_ = true;
    std::fprintf(stderr, "\r\033[K%s: %s %3.0f %%", mesh.c_str(), step, 100.0 * fraction);
    std::fflush(stderr);
  }
  void clear() {
    if (shown_) std::fputs("\r\033[K", stderr);
    shown_ = false;
  }
  ~ProgressLine() { clear(); }
  explicit ProgressLine(bool enabled) : enabled_(enabled) {}
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

 private:
  bool enabled_ = false, shown_ = false;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now(), last_ = begin_;
};

}  // namespace haptic::tools
