// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/servo_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

namespace haptic::hal {

std::string to_text(const ProcessEnd& end) {
  if (!end.ended) return "running";
  if (end.signal == 0) return "exit code " + std::to_string(end.exit_code);
  return "killed by signal " + std::to_string(end.signal) + " (" + strsignal(end.signal) + ")";
}

ServoProcess::~ServoProcess() {
  if (pid_ > 0 && !end_.ended) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  if (descriptor_ >= 0) close(descriptor_);
}

int ServoProcess::start(const std::function<int()>& body) {
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) return errno;
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(1);  // it died before the line above
    _exit(body());
  }
  pid_ = child;
  // Linux 5.3; without it poll() looks by itself.
  descriptor_ = static_cast<int>(syscall(SYS_pidfd_open, child, 0));
  return 0;
}

ProcessEnd ServoProcess::poll(int timeout_ms) noexcept {
  if (pid_ <= 0 || end_.ended) return end_;
  if (timeout_ms > 0) {
    if (descriptor_ >= 0) {
      pollfd watched{descriptor_, POLLIN, 0};
      ::poll(&watched, 1, timeout_ms);
    } else {
      ::poll(nullptr, 0, timeout_ms);
    }
  }
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) != pid_) return end_;
  end_.ended = true;
  if (WIFSIGNALED(status)) end_.signal = WTERMSIG(status);
  if (WIFEXITED(status)) end_.exit_code = WEXITSTATUS(status);
  return end_;
}

void ServoProcess::signal(int number) noexcept {
  if (pid_ > 0 && !end_.ended) kill(pid_, number);
}

}  // namespace haptic::hal
