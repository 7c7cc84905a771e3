// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/stop_signals.hpp"

#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <iterator>

namespace haptic::hal {
namespace {

constexpr int kStops[] = {SIGHUP,    SIGINT,  SIGQUIT, SIGTERM, SIGUSR1, SIGUSR2,   SIGALRM,
                          SIGVTALRM, SIGPROF, SIGXCPU, SIGIO,   SIGPWR,  SIGSTKFLT, SIGTSTP};
constexpr int kIgnored[] = {SIGPIPE, SIGTTIN, SIGTTOU, SIGXFSZ};
constexpr int kFatal[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP};

std::array<std::atomic<const ZeroCommand*>, kMostDevices> fatal_commands{};
static_assert(std::atomic<const ZeroCommand*>::is_always_lock_free);

struct sigaction before_fatal[std::size(kFatal)];

void on_fatal(int number) {
  for (auto& each : fatal_commands) {
    const ZeroCommand* const command = each.exchange(nullptr, std::memory_order_acq_rel);
    if (command != nullptr) (void)send_zero(*command);
  }
  for (std::size_t k = 0; k < std::size(kFatal); ++k) {
    if (kFatal[k] == number) sigaction(number, &before_fatal[k], nullptr);
  }
  raise(number);
}

sigset_t stops() noexcept {
  sigset_t set;
  sigemptyset(&set);
  for (const int number : kStops) sigaddset(&set, number);
  for (int number = SIGRTMIN; number <= SIGRTMAX; ++number) sigaddset(&set, number);
  return set;
}

void ignore(int number) noexcept {
  struct sigaction action {};
  action.sa_handler = SIG_IGN;
  sigaction(number, &action, nullptr);
}

}  // namespace

int StopSignals::take() noexcept {
  const sigset_t set = stops();
  const int error = pthread_sigmask(SIG_BLOCK, &set, &mask_before_);
  if (error != 0) return error;
  descriptor_ = signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
  if (descriptor_ < 0) {
    const int refused = errno;
    pthread_sigmask(SIG_SETMASK, &mask_before_, nullptr);
    return refused;
  }
  for (const int number : kIgnored) ignore(number);
  struct sigaction told {};
  told.sa_handler = SIG_DFL;
  sigaction(SIGCHLD, &told, nullptr);
  return 0;
}

void block_stop_signals() noexcept {
  const sigset_t set = stops();
  (void)pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

void StopSignals::give_back() noexcept {
  if (descriptor_ < 0) return;
  while (asked() != 0) {
  }
  close(descriptor_);
  descriptor_ = -1;
  pthread_sigmask(SIG_SETMASK, &mask_before_, nullptr);
}

int StopSignals::asked() noexcept {
  signalfd_siginfo info;
  if (descriptor_ < 0 || read(descriptor_, &info, sizeof info) != sizeof info) return 0;
  return static_cast<int>(info.ssi_signo);
}

void leave_signals_to_holder() noexcept {
  for (const int number : kStops) {
    if (number != SIGXCPU) ignore(number);  // its own: it has spun for too long
  }
  for (const int number : kIgnored) ignore(number);
  for (int number = SIGRTMIN; number <= SIGRTMAX; ++number) ignore(number);
}

void send_zero_on_fatal(std::size_t device, const ZeroCommand* command) noexcept {
  fatal_commands[device].store(command, std::memory_order_release);
  // Each device has a thread of its own that says so.
  static std::atomic<bool> handled{false};
  if (command == nullptr || handled.exchange(true)) return;
  for (std::size_t k = 0; k < std::size(kFatal); ++k) {
    struct sigaction action {};
    action.sa_handler = on_fatal;
    action.sa_flags = SA_NODEFER;
    sigaction(kFatal[k], &action, &before_fatal[k]);
  }
}

std::string signal_text(int number) {
  const char* const name = sigabbrev_np(number);
  const char* const text = sigdescr_np(number);
  if (name == nullptr) return "signal " + std::to_string(number);
  return std::string("SIG") + name + " (" + (text != nullptr ? text : "?") + ")";
}

}  // namespace haptic::hal
