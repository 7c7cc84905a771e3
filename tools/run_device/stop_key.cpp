// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/stop_key.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

namespace haptic::tools {

StopKey::StopKey(const std::string& path)
    : terminal_(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_NOCTTY | O_CLOEXEC)) {
  if (terminal_ >= 0 && isatty(terminal_) == 0) drop();
}

StopKey::~StopKey() {
  if (changed_ && is_ours()) (void)tcsetattr(terminal_, TCSANOW, &before_);
  drop();
}

void StopKey::drop() noexcept {
  if (terminal_ >= 0) ::close(terminal_);
  terminal_ = -1;
}

// To read or to change it from the background would stop the process. A terminal that is not the
// process's own knows no background.
bool StopKey::is_ours() const noexcept {
  const pid_t group = tcgetpgrp(terminal_);
  return group < 0 ? errno == ENOTTY : group == getpgrp();
}

// A shell puts its own settings back whenever it has stopped the process.
void StopKey::take_over() noexcept {
  termios now{};
  if (tcgetattr(terminal_, &now) != 0 || (now.c_lflag & ICANON) == 0) return;
  if (!changed_) before_ = now;
  changed_ = true;
  now.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  now.c_cc[VMIN] = 0;
  now.c_cc[VTIME] = 0;
  (void)tcsetattr(terminal_, TCSANOW, &now);
}

bool StopKey::pressed() noexcept {
  if (terminal_ < 0 || !is_ours()) return false;
  take_over();
  std::array<char, 64> keys{};
  const ssize_t count = ::read(terminal_, keys.data(), keys.size());
  if (count < 0 && errno != EAGAIN && errno != EINTR) drop();  // hung up
  return std::any_of(keys.begin(), keys.begin() + std::max<ssize_t>(count, 0),
                     [](char key) { return key == ' ' || key == 'e' || key == 'E'; });
}

}  // namespace haptic::tools
