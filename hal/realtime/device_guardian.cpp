// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/device_guardian.hpp"

#include <linux/futex.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <new>

namespace haptic::hal {
namespace {

// Where no descriptor tells of a process's end, it is looked for this often.
constexpr int kBlindLook_ms = 2;
constexpr int kMostExitCode = 4;

}  // namespace

/// In shared memory, one for each process. `calls` grows whenever one of the others changes.
struct alignas(64) DeviceGuardian::Control {
  DeviceMailbox mailbox;
  std::atomic<std::uint32_t> calls{0};
  std::atomic<bool> go{false}, stop{false};

  void call() noexcept {
    calls.fetch_add(1, std::memory_order_release);
    // Not FUTEX_PRIVATE: the sleeper is another process.
    syscall(SYS_futex, &calls, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
  }
  void tell_stop() noexcept {
    stop.store(true, std::memory_order_release);
    call();
  }
  /// Returns false when asked to stop instead.
  [[nodiscard]] bool wait_for_go() noexcept {
    for (;;) {
      const std::uint32_t seen = calls.load(std::memory_order_acquire);
      if (stop.load(std::memory_order_acquire)) return false;
      if (go.load(std::memory_order_acquire)) return true;
      syscall(SYS_futex, &calls, FUTEX_WAIT, seen, nullptr, nullptr, 0);
    }
  }
};
static_assert(std::atomic<bool>::is_always_lock_free &&
                  sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t),
              "shared by processes; the futex is the word itself");

DeviceGuardian::~DeviceGuardian() {
  stop();
  give_signals_back();
}

int DeviceGuardian::take_signals() noexcept {
  sigset_t stops;
  sigemptyset(&stops);
  sigaddset(&stops, SIGINT);
  sigaddset(&stops, SIGTERM);
  const int error = pthread_sigmask(SIG_BLOCK, &stops, &mask_before_);
  if (error != 0) return error;
  signals_ = signalfd(-1, &stops, SFD_CLOEXEC | SFD_NONBLOCK);
  if (signals_ >= 0) return 0;
  const int refused = errno;
  pthread_sigmask(SIG_SETMASK, &mask_before_, nullptr);
  return refused;
}

void DeviceGuardian::give_signals_back() noexcept {
  if (signals_ < 0) return;
  while (stop_asked()) {
  }
  close(signals_);
  signals_ = -1;
  pthread_sigmask(SIG_SETMASK, &mask_before_, nullptr);
}

bool DeviceGuardian::stop_asked() noexcept {
  signalfd_siginfo info;
  return signals_ >= 0 && read(signals_, &info, sizeof info) == sizeof info;
}

int DeviceGuardian::start(const ServoBody& body) {
  if (!seats_.empty()) return EBUSY;
  const std::size_t control_bytes = sizeof(Control);
  const std::size_t flight_bytes = FlightRecorder::bytes_for(settings_.recorded_ticks);
  static_assert(sizeof(Control) % 64 == 0, "the recorder behind it is aligned to 64");
  const std::size_t stride = control_bytes + (flight_bytes + 63) / 64 * 64;
  const std::size_t count = 1 + std::size_t{settings_.spares};
  memory_.emplace(stride * count);
  if (memory_->bytes().empty()) return ENOMEM;
  for (std::size_t k = 0; k < count; ++k) {
    const std::span<std::byte> bytes = memory_->bytes().subspan(k * stride, stride);
    seats_.push_back(std::make_unique<Seat>());
    seats_.back()->control = new (bytes.data()) Control;
    seats_.back()->flight = bytes.subspan(control_bytes, flight_bytes);
  }
  seats_[0]->control->go.store(true, std::memory_order_release);

  int error = take_signals();
  for (unsigned k = 0; error == 0 && k < count; ++k)
    error = seats_[k]->process.start([this, k, &body] { return sit(k, body); });
  if (error != 0) {
    seats_.clear();  // kills those that were forked
    give_signals_back();
  }
  return error;
}

/// In the child. Its signals: the parent's mask of before, SIGTERM says stop.
int DeviceGuardian::sit(unsigned number, const ServoBody& body) {
  static Control* told;
  Seat& seat = *seats_[number];
  told = seat.control;
  struct sigaction action {};
  action.sa_handler = SIG_IGN;
  sigaction(SIGINT, &action, nullptr);
  action.sa_handler = [](int) {
    told->stop.store(true, std::memory_order_release);
    told->calls.fetch_add(1, std::memory_order_release);
  };
  sigaction(SIGTERM, &action, nullptr);
  close(signals_);
  pthread_sigmask(SIG_SETMASK, &mask_before_, nullptr);

  if (!seat.control->wait_for_go()) return kGuardianDone;
  memory_->enter();
  return body({number, seat.control->mailbox, seat.flight, seat.control->stop});
}

DeviceMailbox& DeviceGuardian::mailbox() noexcept { return seats_[at_work_]->control->mailbox; }

int DeviceGuardian::pid() const noexcept {
  return seats_.empty() ? -1 : seats_[at_work_]->process.pid();
}

std::vector<StepTrace> DeviceGuardian::flight_of(const Seat& seat) {
  std::vector<StepTrace> records(seat.flight.size() / sizeof(StepTrace));
  records.resize(FlightRecorder::copy_newest(seat.flight, records));
  return records;
}

std::vector<StepTrace> DeviceGuardian::flight() const {
  return seats_.empty() ? std::vector<StepTrace>{} : flight_of(*seats_[at_work_]);
}

UsbThreadGrant DeviceGuardian::hold(DeviceLink& link) {
  link_ = &link;
  thread_ = std::make_unique<UsbThread>(link, settings_.thread);
  return thread_->start();
}

GuardianNews DeviceGuardian::wait(int timeout_ms) {
  if (seats_.empty()) return GuardianNews::kNone;
  Seat& seat = *seats_[at_work_];
  const int descriptor = seat.process.descriptor();
  const bool blind = descriptor < 0 && !told_;
  const bool short_look = blind && (timeout_ms < 0 || timeout_ms > kBlindLook_ms);
  pollfd watched[] = {{signals_, POLLIN, 0}, {told_ ? -1 : descriptor, POLLIN, 0}};
  ::poll(watched, 2, short_look ? kBlindLook_ms : timeout_ms);
  if (!told_) {
    const ProcessEnd end = seat.process.poll(0);
    if (end.ended) {
      if (link_ != nullptr) link_->servo_lost();
      told_ = true;
      end_ = {at_work_, seat.process.pid(), end, flight_of(seat)};
      return GuardianNews::kServoEnded;
    }
  }
  return stop_asked() ? GuardianNews::kStopAsked : GuardianNews::kNone;
}

bool DeviceGuardian::take_over() {
  if (!told_ || stopped_) return false;
  for (unsigned k = at_work_ + 1; k < seats_.size(); ++k) {
    Seat& seat = *seats_[k];
    if (seat.process.poll(0).ended) continue;  // killed in its sleep
    at_work_ = k;
    told_ = false;
    if (link_ != nullptr) link_->use_mailbox(seat.control->mailbox);
    seat.control->go.store(true, std::memory_order_release);
    seat.control->call();
    return true;
  }
  return false;
}

bool DeviceGuardian::stop() {
  if (stopped_) return orderly_;
  stopped_ = true;
  for (const auto& seat : seats_) seat->control->tell_stop();
  if (thread_ != nullptr) thread_->stop();
  for (unsigned k = 0; k < seats_.size(); ++k) {
    const bool known = k < at_work_ || (k == at_work_ && told_);
    const ProcessEnd end = seats_[k]->process.finish(settings_.stop_wait_ms);
    if (!known && (end.signal != 0 || end.exit_code != 0)) orderly_ = false;
  }
  return orderly_;
}

int DeviceGuardian::run(const std::function<void(const ServoEnd&)>& told) {
  int code = kGuardianDone;
  for (bool goes_on = true; goes_on;) {
    const GuardianNews news = wait(-1);
    if (news == GuardianNews::kStopAsked) break;
    if (news != GuardianNews::kServoEnded) continue;
    told(end_);
    const int exit_code = end_.end.exit_code;
    if (end_.end.signal != 0) {
      code = kGuardianServoFailed;
      goes_on = take_over();
    } else {
      const bool known = exit_code >= 0 && exit_code <= kMostExitCode;
      if (exit_code != 0) code = known ? exit_code : kGuardianServoFailed;
      goes_on = false;
    }
  }
  if (!stop() && code == kGuardianDone) code = kGuardianServoFailed;
  return code;
}

}  // namespace haptic::hal
