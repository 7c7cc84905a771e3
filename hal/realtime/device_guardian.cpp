// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/device_guardian.hpp"

#include <linux/futex.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <new>

#include "hal/clock/servo_clock.hpp"
#include "hal/realtime/process_hardening.hpp"

namespace haptic::hal {
namespace {

// The processes are looked at this often; where no descriptor tells of an end, more often.
constexpr int kLook_ms = 20, kBlindLook_ms = 2;
// Most time that one look adds to a silence: this process itself may have been held up.
constexpr std::int64_t kMostSilence_ns = 2 * std::int64_t{kLook_ms} * 1'000'000;
constexpr int kMostExitCode = 4;
// Longest time under SCHED_FIFO without a sleep [us]: far beyond a tick, short enough to leave the
// core to others.
constexpr rlim_t kLongestSpin_us = 100'000, kLongestSpinOfHolder_us = 400'000;

constexpr std::size_t rounded_up(std::size_t bytes) { return (bytes + 63) / 64 * 64; }

void limit_spinning(rlim_t soft_us) noexcept {
  const rlimit limit{soft_us, 2 * soft_us};
  (void)setrlimit(RLIMIT_RTTIME, &limit);
}

void wake(std::atomic<std::uint32_t>& word) noexcept {
  // Not FUTEX_PRIVATE: the sleeper is another process.
  syscall(SYS_futex, &word, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
}

}  // namespace

/// Written by the guardian. `calls` grows whenever one of the words changes.
struct alignas(64) DeviceGuardian::Orders {
  std::array<StateHalf, kMostDevices> states;
  std::atomic<std::uint32_t> calls{0};
  std::atomic<bool> go{false}, stop{false};
  std::atomic<std::uint64_t> order{0};

  void say(std::atomic<bool>& word) noexcept {
    word.store(true, std::memory_order_release);
    calls.fetch_add(1, std::memory_order_release);
    wake(calls);
  }
  /// In the child. Returns false when asked to stop instead.
  [[nodiscard]] bool wait_for_go() const noexcept {
    for (;;) {
      const std::uint32_t seen = calls.load(std::memory_order_acquire);
      if (stop.load(std::memory_order_acquire)) return false;
      if (go.load(std::memory_order_acquire)) return true;
      syscall(SYS_futex, &calls, FUTEX_WAIT, seen, nullptr, nullptr, 0);
    }
  }
};

/// Written by the servo process; behind it the flight recorders and the report.
struct alignas(64) DeviceGuardian::Reports {
  std::array<CommandHalf, kMostDevices> commands;
};
static_assert(std::atomic<bool>::is_always_lock_free &&
                  sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t),
              "shared by processes; the futex is the word itself");

std::string to_text(const ServoEnd& end) {
  if (!end.hung) return to_text(end.end);
  return "hung, and killed for it: no tick came any more";
}

DeviceGuardian::DeviceGuardian(const GuardianSettings& settings) : settings_(settings) {
  settings_.devices = std::clamp<std::size_t>(settings.devices, 1, kMostDevices);
}

DeviceGuardian::~DeviceGuardian() { stop(); }

int DeviceGuardian::make_seats() {
  const std::size_t flight_bytes = rounded_up(FlightRecorder::bytes_for(settings_.recorded_ticks));
  const std::size_t flights_bytes = settings_.devices * flight_bytes;
  const std::size_t up_bytes = sizeof(Reports) + flights_bytes + settings_.report_bytes;
  for (unsigned k = 0; k <= settings_.spares; ++k) {
    seats_.push_back(std::make_unique<Seat>(up_bytes, sizeof(Orders),
                                            settings_.has_reader
                                                ? SharedMemory::Readers::kByDescriptor
                                                : SharedMemory::Readers::kChildren));
    Seat& seat = *seats_.back();
    if (seat.up.bytes().empty() || seat.down.bytes().empty()) return ENOMEM;
    auto* const reports = new (seat.up.bytes().data()) Reports;
    seat.orders = new (seat.down.bytes().data()) Orders;
    seat.orders->order.store(settings_.order, std::memory_order_relaxed);
    for (std::size_t d = 0; d < settings_.devices; ++d) {
      seat.mailboxes[d] = {&seat.orders->states[d], &reports->commands[d]};
      seat.flights[d] = seat.up.bytes().subspan(sizeof(Reports) + d * flight_bytes, flight_bytes);
    }
    seat.report = seat.up.bytes().subspan(sizeof(Reports) + flights_bytes);
  }
  return 0;
}

int DeviceGuardian::start_keepers() {
  int error = 0;
  for (Hold& hold : holds()) {
    if (error == 0) error = hold.keeper.start();
  }
  return error;
}

void DeviceGuardian::stop_keepers() noexcept {
  for (Hold& hold : holds()) hold.keeper.stop();
}

int DeviceGuardian::start(const ServoBody& body) {
  if (!seats_.empty()) return EBUSY;
  int error = make_seats();
  if (error == 0) error = signals_.take();
  if (error == 0) error = start_keepers();
  if (error == 0) begin_seat(0);
  for (unsigned k = 0; error == 0 && k < seats_.size(); ++k)
    error = seats_[k]->process.start([this, k, &body] { return sit(k, body); });
  if (error == 0 && settings_.watcher) error = watcher_.start([this] { return watch(); });
  if (error != 0) {
    seats_.clear();  // kills those that were forked
    stop_keepers();
    signals_.give_back();
    return error;
  }
  limit_spinning(kLongestSpinOfHolder_us);
  return 0;
}

void DeviceGuardian::begin_seat(unsigned number) noexcept {
  Seat& seat = *seats_[number];
  at_work_ = number;
  told_ = hung_ = false;
  ticks_ = std::make_unique<NewestReader<DeviceCommand>>(seat.mailboxes[0].commands->newest);
  tick_ = 0;
  looked_ns_ = monotonic_ns();
  silence_ns_ = 0;
  for (std::size_t d = 0; d < settings_.devices; ++d) {
    if (holds_[d].link != nullptr) holds_[d].link->use_mailbox(seat.mailboxes[d]);
  }
  seat.orders->say(seat.orders->go);
}

/// In the child. Nothing of the others is left in it: a process that writes wildly meets its own
/// reports, or dies.
int DeviceGuardian::sit(unsigned number, const ServoBody& body) {
  leave_signals_to_holder();
  sigset_t none;
  sigemptyset(&none);
  pthread_sigmask(SIG_SETMASK, &none, nullptr);
  prctl(PR_SET_NAME, number == 0 ? "haptic-servo" : "haptic-spare");
  for (Hold& hold : holds()) hold.keeper.leave();
  for (unsigned k = 0; k < seats_.size(); ++k) {
    if (k == number) continue;
    seats_[k]->up.leave();
    seats_[k]->down.leave();
  }
  Seat& seat = *seats_[number];
  if (seat.down.protect() != 0) return kGuardianOsRefused;
  limit_spinning(kLongestSpin_us);

  if (!seat.orders->wait_for_go()) return kGuardianDone;
  seat.up.enter();
  seat.down.enter();
  return body({number, std::span(seat.mailboxes).first(settings_.devices),
               std::span(seat.flights).first(settings_.devices), seat.report, seat.orders->stop,
               seat.orders->order});
}

/// In the child that watches. It can write to none of the others' memory.
int DeviceGuardian::watch() {
  leave_signals_to_holder();
  sigset_t none;
  sigemptyset(&none);
  pthread_sigmask(SIG_SETMASK, &none, nullptr);
  prctl(PR_SET_NAME, "haptic-watcher");
  const sched_param ordinary{};
  if (sched_setscheduler(0, SCHED_IDLE, &ordinary) != 0) return kGuardianOsRefused;
  for (Hold& hold : holds()) hold.keeper.leave();
  std::vector<std::span<const std::byte>> flights;
  for (const auto& seat : seats_) {
    seat->down.leave();
    if (seat->up.protect() != 0) return kGuardianOsRefused;
    for (std::size_t d = 0; d < settings_.devices; ++d) flights.emplace_back(seat->flights[d]);
  }
  return settings_.watcher(flights);
}

int DeviceGuardian::pid() const noexcept {
  return seats_.empty() ? -1 : seats_[at_work_]->process.pid();
}

std::span<std::byte> DeviceGuardian::report(unsigned number) noexcept {
  return seats_[number]->report;
}

void DeviceGuardian::order(unsigned number, std::uint64_t value) noexcept {
  seats_[number]->orders->order.store(value, std::memory_order_release);
}

ServoReports DeviceGuardian::reports(unsigned number) const {
  const Seat& seat = *seats_[number];
  ServoReports reports;
  reports.descriptor = seat.up.descriptor();
  reports.memory = seat.up.bytes();
  for (std::size_t d = 0; d < settings_.devices; ++d) reports.flights[d] = seat.flights[d];
  reports.report = seat.report;
  return reports;
}

std::vector<StepTrace> DeviceGuardian::flight_of(const Seat& seat, std::size_t device) {
  const std::span<const std::byte> flight = seat.flights[device];
  std::vector<StepTrace> records(flight.size() / sizeof(StepTrace));
  records.resize(FlightRecorder::copy_newest(flight, records));
  return records;
}

std::vector<StepTrace> DeviceGuardian::flight(std::size_t device) const {
  return seats_.empty() ? std::vector<StepTrace>{} : flight_of(*seats_[at_work_], device);
}

UsbThreadGrant DeviceGuardian::hold(DeviceLink& link, std::size_t device) {
  Hold& hold = holds_[device];
  hold.link = &link;
  UsbThreadSettings settings = settings_.thread;
  settings.turns = hold.keeper.turns();
  hold.thread = std::make_unique<UsbThread>(link, settings);
  return hold.thread->start();
}

void DeviceGuardian::tell_servo_lost() noexcept {
  for (Hold& hold : holds()) {
    if (hold.link != nullptr) hold.link->servo_lost();
  }
}

void DeviceGuardian::look_at_ticks() noexcept {
  const std::int64_t now = monotonic_ns();
  const std::uint64_t tick = ticks_->newest().tick;
  if (tick != tick_) {
    tick_ = tick;
    silence_ns_ = 0;
  } else {
    silence_ns_ += std::min(now - looked_ns_, kMostSilence_ns);
  }
  looked_ns_ = now;
  const int most_ms = tick_ == 0 ? settings_.first_tick_ms : settings_.hung_ms;
  if (told_ || hung_ || stopped_ || silence_ns_ <= std::int64_t{most_ms} * 1'000'000) return;
  hung_ = true;
  tell_servo_lost();
  seats_[at_work_]->process.signal(SIGKILL);
}

bool DeviceGuardian::look_for_end() {
  if (told_) return false;
  Seat& seat = *seats_[at_work_];
  const ProcessEnd end = seat.process.poll(0);
  if (!end.ended) return false;
  tell_servo_lost();
  told_ = true;
  end_ = {at_work_, seat.process.pid(), end, hung_, {}};
  for (std::size_t d = 0; d < settings_.devices; ++d) end_.records[d] = flight_of(seat, d);
  return true;
}

bool DeviceGuardian::look_for_keeper() noexcept {
  if (stopped_) return false;
  for (std::size_t d = 0; d < settings_.devices; ++d) {
    Hold& hold = holds_[d];
    if (hold.keeper_end.ended) continue;
    hold.keeper_end = hold.keeper.look();
    if (!hold.keeper_end.ended) continue;
    ended_keeper_ = d;
    return true;
  }
  return false;
}

GuardianNews DeviceGuardian::wait(int timeout_ms) {
  if (seats_.empty()) return GuardianNews::kNone;
  for (int left_ms = timeout_ms; timeout_ms < 0 || left_ms >= 0;) {
    const int descriptor = seats_[at_work_]->process.descriptor();
    const int look_ms = descriptor < 0 && !told_ ? kBlindLook_ms : kLook_ms;
    const int turn_ms = timeout_ms < 0 ? look_ms : std::min(look_ms, left_ms);
    std::array<pollfd, 3 + kMostDevices> watched{};
    watched[0] = {signals_.descriptor(), POLLIN, 0};
    watched[1] = {told_ ? -1 : descriptor, POLLIN, 0};
    for (std::size_t d = 0; d < kMostDevices; ++d) {
      const Hold& hold = holds_[d];
      watched[2 + d] = {hold.keeper_end.ended ? -1 : hold.keeper.descriptor(), POLLIN, 0};
    }
    pollfd& caller = watched.back();
    caller = {caller_, POLLIN, 0};
    ::poll(watched.data(), watched.size(), turn_ms);
    look_at_ticks();
    if (look_for_end()) return GuardianNews::kServoEnded;
    if (const int number = signals_.asked(); number != 0) {
      stop_signal_ = number;
      return GuardianNews::kStopAsked;
    }
    if (look_for_keeper()) return GuardianNews::kKeeperEnded;
    if (caller.revents != 0) return GuardianNews::kCalled;
    if (timeout_ms >= 0) left_ms -= std::max(turn_ms, 1);
  }
  return GuardianNews::kNone;
}

bool DeviceGuardian::take_over() {
  if (!told_ || stopped_) return false;
  for (unsigned k = at_work_ + 1; k < seats_.size(); ++k) {
    Seat& seat = *seats_[k];
    if (seat.process.is_stopped()) seat.process.finish(0);
    if (seat.process.poll(0).ended) continue;  // killed in its sleep
    begin_seat(k);
    return true;
  }
  return false;
}

bool DeviceGuardian::stop() {
  if (seats_.empty() || stopped_) return orderly_;
  stopped_ = true;
  for (const auto& seat : seats_) seat->orders->say(seat->orders->stop);
  // Each ends in order, and lets go of its link; one after the other would let the second press on.
  for (Hold& hold : holds()) {
    if (hold.thread != nullptr) hold.thread->begin_stop();
  }
  for (Hold& hold : holds()) hold.thread.reset();
  for (unsigned k = 0; k < seats_.size(); ++k) {
    const bool known = k < at_work_ || (k == at_work_ && told_);
    const ProcessEnd end = seats_[k]->process.finish(settings_.stop_wait_ms);
    if (!known && (end.signal != 0 || end.exit_code != 0)) orderly_ = false;
  }
  stop_keepers();
  static_cast<void>(watcher_.finish(0));
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
