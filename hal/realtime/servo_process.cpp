// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/servo_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "hal/clock/servo_clock.hpp"

namespace haptic::hal {
namespace {

constexpr std::int64_t kNsPerMs = 1'000'000;
// How long a look may take where no descriptor tells of the end.
constexpr int kBlindWait_ms = 5;

// As exec does: what is handled in the parent is handled with what the parent has.
void reset_handlers() noexcept {
  for (int number = 1; number < NSIG; ++number) {
    struct sigaction action {};
    if (sigaction(number, nullptr, &action) != 0) continue;
    const bool handled = (action.sa_flags & SA_SIGINFO) != 0 || action.sa_handler != SIG_IGN;
    if (!handled) continue;
    action = {};
    action.sa_handler = SIG_DFL;
    sigaction(number, &action, nullptr);
  }
}

// Nothing of the parent's stack is unwound in the child, also when the body throws.
[[noreturn]] void run_child(const std::function<int()>& body) noexcept { _exit(body()); }

int reap(int pid, int& status, int options) noexcept {
  int result = -1;
  do {
    result = waitpid(pid, &status, options);
  } while (result < 0 && errno == EINTR);
  return result;
}

}  // namespace

std::string to_text(const ProcessEnd& end) {
  if (!end.ended) return "running";
  if (end.signal == 0) return "exit code " + std::to_string(end.exit_code);
  return "killed by signal " + std::to_string(end.signal) + " (" + strsignal(end.signal) + ")";
}

ServoProcess::~ServoProcess() {
  if (pid_ > 0 && !end_.ended) static_cast<void>(finish(0));
  if (descriptor_ >= 0) close(descriptor_);
}

int ServoProcess::start(const std::function<int()>& body, Tie tie) {
  if (pid_ > 0) return EBUSY;
  const pid_t parent = getpid();
  // A signal that comes before the handlers are reset is not for the parent's.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  const pid_t child = fork();
  const int error = errno;
  if (child == 0) {
    if (tie == Tie::kDiesWithParent) prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(EXIT_FAILURE);  // it died before the line above
    reset_handlers();
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    run_child(body);
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  if (child < 0) return error;
  pid_ = child;
  // Linux 5.3; without it poll() looks by itself.
  descriptor_ = static_cast<int>(syscall(SYS_pidfd_open, child, 0));
  return 0;
}

ProcessEnd ServoProcess::poll(int timeout_ms) noexcept {
  if (pid_ <= 0 || end_.ended) return end_;
  if (timeout_ms > 0) {
    pollfd watched{descriptor_, POLLIN, 0};  // a negative one is left out
    ::poll(&watched, 1, descriptor_ >= 0 ? timeout_ms : std::min(timeout_ms, kBlindWait_ms));
  }
  int status = 0;
  const int result = reap(pid_, status, WNOHANG);
  if (result == 0) return end_;
  end_.ended = true;
  if (result != pid_) {
    end_.exit_code = -1;
    return end_;
  }
  if (WIFSIGNALED(status)) end_.signal = WTERMSIG(status);
  if (WIFEXITED(status)) end_.exit_code = WEXITSTATUS(status);
  return end_;
}

bool ServoProcess::is_stopped() const noexcept {
  if (pid_ <= 0 || end_.ended) return false;
  siginfo_t info{};
  // Only looked at: the same answer next time.
  const int result = waitid(P_PID, static_cast<id_t>(pid_), &info, WSTOPPED | WNOHANG | WNOWAIT);
  return result == 0 && info.si_pid == pid_;
}

ProcessEnd ServoProcess::finish(int timeout_ms) noexcept {
  const std::int64_t end_ns = monotonic_ns() + timeout_ms * kNsPerMs;
  while (pid_ > 0 && !end_.ended && monotonic_ns() < end_ns) {
    const std::int64_t left_ms = (end_ns - monotonic_ns()) / kNsPerMs;
    static_cast<void>(poll(static_cast<int>(left_ms) + 1));
  }
  // Bounded: nothing outlives SIGKILL but a call that the kernel does not interrupt.
  while (pid_ > 0 && !end_.ended) {
    kill(pid_, SIGKILL);
    static_cast<void>(poll(kBlindWait_ms));
  }
  return end_;
}

void ServoProcess::signal(int number) noexcept {
  if (pid_ > 0 && !end_.ended) kill(pid_, number);
}

}  // namespace haptic::hal
