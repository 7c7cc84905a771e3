// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/zero_keeper.hpp"

#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <new>

#include "hal/clock/servo_clock.hpp"
#include "hal/realtime/process_hardening.hpp"
#include "hal/realtime/stop_signals.hpp"

namespace haptic::hal {
namespace {

constexpr int kKeeperLook_ms = 20;
constexpr int kFrozenLooks = static_cast<int>(kLongestFrozen_ns / 1'000'000 / kKeeperLook_ms);
// At the end: more than one, since the bus may refuse the first while it cancels what is in flight.
constexpr int kLastCommands = 5;
constexpr int kKeeperEnd_ms = 200;
// A keeper that has not looked for so long is frozen. Only time in which this process looked
// counts.
constexpr std::int64_t kKeeperStill_ns = 1'000'000'000, kMostPerLook_ns = 50'000'000;

enum class KeeperWord : std::uint8_t { kHold = 1, kRelease, kEnd };

struct KeeperMessage {
  KeeperWord word = KeeperWord::kEnd;
  ZeroCommand command;
};

void send_message(int socket, const KeeperMessage& message, int descriptor) noexcept {
  KeeperMessage copy = message;
  iovec part{&copy, sizeof copy};
  alignas(cmsghdr) char room[CMSG_SPACE(sizeof(int))] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  if (descriptor >= 0) {
    header.msg_control = room;
    header.msg_controllen = sizeof room;
    cmsghdr* const control = CMSG_FIRSTHDR(&header);
    control->cmsg_level = SOL_SOCKET;
    control->cmsg_type = SCM_RIGHTS;
    control->cmsg_len = CMSG_LEN(sizeof(int));
    std::memcpy(CMSG_DATA(control), &descriptor, sizeof descriptor);
  }
  (void)sendmsg(socket, &header, MSG_NOSIGNAL | MSG_DONTWAIT);
}

/// @return bytes received; 0: the other end is closed. `descriptor`: negative where none came.
ssize_t receive_message(int socket, KeeperMessage& message, int& descriptor) noexcept {
  descriptor = -1;
  iovec part{&message, sizeof message};
  alignas(cmsghdr) char room[CMSG_SPACE(sizeof(int))] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = room;
  header.msg_controllen = sizeof room;
  const ssize_t size = recvmsg(socket, &header, MSG_CMSG_CLOEXEC);
  const cmsghdr* const control = size > 0 ? CMSG_FIRSTHDR(&header) : nullptr;
  if (control != nullptr && control->cmsg_type == SCM_RIGHTS)
    std::memcpy(&descriptor, CMSG_DATA(control), sizeof descriptor);
  return size;
}

}  // namespace

int ZeroKeeper::start() {
  down_.emplace(sizeof(FromGuardian));
  up_.emplace(sizeof(FromKeeper));
  if (down_->bytes().empty() || up_->bytes().empty()) return ENOMEM;
  from_guardian_ = new (down_->bytes().data()) FromGuardian;
  from_keeper_ = new (up_->bytes().data()) FromKeeper;
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) return errno;
  socket_ = ends[0];
  const int error = process_.start(
      [this, ends] {
        close(ends[0]);
        return keep(ends[1]);
      },
      ServoProcess::Tie::kOutlivesParent);
  close(ends[1]);
  if (error != 0) leave();
  return error;
}

void ZeroKeeper::leave() noexcept {
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
  down_.reset();
  up_.reset();
  from_guardian_ = nullptr;
  from_keeper_ = nullptr;
}

void ZeroKeeper::stop() noexcept {
  if (socket_ < 0) return;
  send_message(socket_, {KeeperWord::kEnd, {}}, -1);
  (void)process_.finish(kKeeperEnd_ms);
  leave();
}

void ZeroKeeper::hold(const ZeroCommand& command) noexcept {
  send_zero_on_fatal(device_, nullptr);
  held_ = command;
  send_zero_on_fatal(device_, &held_);
  if (socket_ >= 0) send_message(socket_, {KeeperWord::kHold, command}, command.descriptor);
}

void ZeroKeeper::release() noexcept {
  send_zero_on_fatal(device_, nullptr);
  if (socket_ >= 0) send_message(socket_, {KeeperWord::kRelease, {}}, -1);
}

std::uint32_t ZeroKeeper::sent() const noexcept {
  return from_keeper_ != nullptr ? from_keeper_->sent.load(std::memory_order_acquire) : 0;
}

std::atomic<std::uint32_t>* ZeroKeeper::turns() noexcept {
  return from_guardian_ != nullptr ? &from_guardian_->turns : nullptr;
}

ProcessEnd ZeroKeeper::look() noexcept {
  if (socket_ < 0) return {};
  const std::int64_t now = monotonic_ns();
  const std::uint32_t looks = from_keeper_->looks.load(std::memory_order_relaxed);
  if (looks != looks_ || looked_ns_ == 0) {
    still_ns_ = 0;
  } else {
    still_ns_ += std::min(now - looked_ns_, kMostPerLook_ns);
  }
  looks_ = looks;
  looked_ns_ = now;
  if (still_ns_ > kKeeperStill_ns) process_.signal(SIGKILL);
  return process_.poll(0);
}

// In the child. What it does not need is gone by then, but what the parent's stack refers to.
int ZeroKeeper::keep(int socket) noexcept {
  prctl(PR_SET_NAME, device_ == 0 ? "haptic-zero" : "haptic-zero-2");
  (void)setsid();
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, nullptr);
  const int kept[] = {socket};
  (void)close_inherited_descriptors(kept);
  (void)down_->protect();
  (void)down_->enter();
  (void)up_->enter();

  ZeroCommand held;
  std::uint32_t turns = 0;
  int still = 0;
  for (;;) {
    pollfd watched{socket, POLLIN, 0};
    const int ready = ::poll(&watched, 1, kKeeperLook_ms);
    from_keeper_->looks.fetch_add(1, std::memory_order_relaxed);
    if (ready > 0) {
      KeeperMessage message;
      int descriptor = -1;
      const ssize_t size = receive_message(socket, message, descriptor);
      if (size < 0 && errno == EINTR) continue;
      const bool whole = size == static_cast<ssize_t>(sizeof message);
      if (whole && message.word != KeeperWord::kEnd) {
        if (held.descriptor >= 0) close(held.descriptor);
        held = ZeroCommand{};
        if (message.word == KeeperWord::kHold && descriptor >= 0) {
          held = message.command;
          held.descriptor = descriptor;
        }
        still = 0;
        continue;
      }
      // The guardian is gone: it has not said that this is the end.
      for (int k = 0; !whole && k < kLastCommands; ++k) {
        (void)send_zero(held);
        usleep(2000);
      }
      return 0;
    }
    const std::uint32_t now = from_guardian_->turns.load(std::memory_order_relaxed);
    still = now == turns ? still + 1 : 0;
    turns = now;
    const bool unwatched = held.watchdog_ns <= 0 || held.watchdog_ns > kLongestFrozen_ns;
    if (held.descriptor < 0 || !unwatched || still < kFrozenLooks) continue;
    still = 0;
    if (send_zero(held)) from_keeper_->sent.fetch_add(1, std::memory_order_release);
  }
}

}  // namespace haptic::hal
