// SPDX-License-Identifier: Apache-2.0
#include "hal/usb/report_flow.hpp"

#include <sched.h>

#include <algorithm>

#include "hal/clock/servo_clock.hpp"
#include "hal/device_limits.hpp"

namespace haptic::hal {
namespace {

constexpr std::uint32_t kDeviceBits = 0xffff;  // of DeviceFault: what the device says of itself

// A clock that stands still must not hold the thread while it waits for an answer.
constexpr int kMostAnswerLooks = 100'000;

// Sends in a row that may fail before the servo thread is informed: a single one is made good by
// the next.
constexpr unsigned kMostLostSends = 3;

// Reports in a row by which a device has accepted no command: it does not listen.
constexpr std::uint32_t kMostUnanswered = 10;

// The clocks are not read at one instant; a machine sleeps for longer than a thread is held up
// between two reads.
constexpr std::int64_t kShortestSleep_ns = 20'000'000;

bool is_zero(const Wrench& w) noexcept {
  return w.force_w == Vec3::Zero() && w.torque_w == Vec3::Zero();
}

void count_verdict(LinkCounters& counters, ReportVerdict verdict) noexcept {
  count_one(counters.reports);
  switch (verdict) {
    case ReportVerdict::kState:
      return count_one(counters.states);
    case ReportVerdict::kNothing:
      return;
    case ReportVerdict::kBadLength:
      return count_one(counters.bad_length);
    case ReportVerdict::kBadCheck:
      return count_one(counters.bad_check);
    case ReportVerdict::kBadNumber:
      return count_one(counters.bad_number);
    case ReportVerdict::kNotAdvancing:
      return count_one(counters.not_advancing);
  }
}

}  // namespace

ReportFlow::ReportFlow(Driver& driver, const DeviceMailbox& mailbox,
                       const LinkSettings& settings) noexcept
    : driver_(driver),
      mailbox_(mailbox),
      settings_(settings),
      guard_(settings.limits),
      faults_({settings.silence_ns, settings.corrupt_in_a_row, settings.frozen_in_a_row}),
      gripper_(settings.gripper),
      period_ns_(usable(settings.limits).period_ns) {}

std::int64_t ReportFlow::now_ns() const noexcept {
  const std::int64_t now = clock_ns();
  note({.kind = LinkEventKind::kClock, .stamp_ns = now});
  return now;
}

std::int64_t ReportFlow::clock_ns() const noexcept {
  return settings_.clock != nullptr ? settings_.clock(settings_.clock_context) : monotonic_ns();
}

// Half-written values of the previous servo process are not read again.
DeviceSide& ReportFlow::mailbox() noexcept {
  if (next_mailbox_.load(std::memory_order_relaxed) != nullptr) {
    // Acquire: the other half of use_mailbox.
    mailbox_ = DeviceSide(*next_mailbox_.exchange(nullptr, std::memory_order_acquire));
  }
  return mailbox_;
}

std::int64_t ReportFlow::slept_ns() const noexcept {
  if (settings_.slept != nullptr) return settings_.slept(settings_.clock_context);
  return settings_.clock != nullptr ? 0 : machine_slept_ns();
}

void ReportFlow::take_command() noexcept {
  const std::uint64_t tick = command_.tick;
  const std::int64_t stamp_ns = command_.stamp_ns;
  command_ = mailbox().command();
  if (command_.tick != tick || command_.stamp_ns != stamp_ns)
    note({.kind = LinkEventKind::kCommand, .stamp_ns = command_.stamp_ns, .number = command_.tick});
  faults_.answered(command_);
}

void ReportFlow::publish(bool with_report, HalStatus why) noexcept {
  DeviceState published = state_;
  published.faults = (state_.faults & kDeviceBits) | faults_.shown();
  published_ = published.faults;
  if (with_report) faults_.carried(published.sequence);
  mailbox().publish(published, settings_.wake_servo);
  if (tape_ != nullptr) tape_->on_state(published);
  if (link_.exchange(published.link, std::memory_order_acq_rel) == published.link) return;
  const std::int64_t now = now_ns();
  note({.kind = LinkEventKind::kLink,
        .code = static_cast<std::uint8_t>(published.link),
        .why = static_cast<std::uint8_t>(why),
        .stamp_ns = now});
  if (observer_ != nullptr) observer_->on_link(now, published.link, why);
}

// A fault goes out at once; the pose with it is the last one, with its own number and stamp.
void ReportFlow::publish_changes() noexcept {
  if (((state_.faults & kDeviceBits) | faults_.shown()) != published_) publish(false);
}

void ReportFlow::begin_start() noexcept {
  state_.link = LinkState::kStarting;
  state_.faults = 0;
  publish(false);
}

// As the device states them at this connection: it may be another one than at the last.
void ReportFlow::take_limits() noexcept {
  const DeviceCapabilities& now = driver_.capabilities();
  other_device_ = connection_ != 0 && !(now == stated_);
  stated_ = now;
  faults_.expect_reports_every(stated_.report_period_ns);
  const SafetyLimits limits =
      limits_of_connection(settings_.limits, stated_, settings_.force_share);
  guard_.limit(limits);
  guard_.follow_reports(stated_.report_period_ns);
  state_.limits = limits_record(limits, stated_, ++connection_);
  if (other_device_) faults_.raise(kLinkOtherDevice);
}

void ReportFlow::begin_reports() noexcept {
  count_one(counters_.connects);
  const std::int64_t now = now_ns();
  take_command();
  guard_.hold_back(command_);
  faults_.begin(now);
  take_limits();
  sent_.begin();
  driven_ns_ = now - period_ns_;  // a device in lock-step says nothing before it is spoken to
  timed_ = true;
  owed_ = resting_ = zero_delivered_ = releasing_ = at_rest_ = false;
  slept_ns_ = slept_ns();
  lost_sends_ = 0;
  state_.accepted_d = WrenchRecord{};
  state_.accepted_tick = 0;
  publish(false);
}

void ReportFlow::end(bool lost, HalStatus why) noexcept {
  if (lost) {
    count_one(counters_.disconnects);
    faults_.set_present(kLinkLost, true);
    guard_.latch(kLinkLost);
    guard_faults_ |= kLinkLost;
  }
  if (zero_held_) settings_.zero_holder->release();
  zero_held_ = false;
  sent_.begin();
  if (lost)
    held_until_ns_.store(clock_ns() + std::max(stated_.watchdog_ns, settings_.silence_ns));
  else
    tell_held({});
  gripper_.open();
  gap_m_.store(-1.0, std::memory_order_relaxed);
  state_.link = LinkState::kAbsent;
  state_.twist_valid = false;
  state_.faults = 0;
  state_.accepted_d = WrenchRecord{};
  state_.accepted_tick = 0;
  publish(false, why);
}

void ReportFlow::on_report(std::span<const std::uint8_t> bytes) noexcept {
  const std::int64_t now = now_ns();
  take_report(bytes, now, now);
}

void ReportFlow::on_report(std::span<const std::uint8_t> bytes, std::int64_t sampled_ns) noexcept {
  const std::int64_t now = now_ns();
  take_report(bytes, now, std::min(std::max(sampled_ns, state_.stamp_ns), now));
}

void ReportFlow::take_report(std::span<const std::uint8_t> bytes, std::int64_t now_ns,
                             std::int64_t stamp_ns) noexcept {
  verdict_ = driver_.read(bytes, stamp_ns, state_);
  count_verdict(counters_, verdict_);
  faults_.note(verdict_, stamp_ns);
  follow_switches();
  if (verdict_ == ReportVerdict::kState) {
    follow_gripper();
    const CommandReceipt receipt = driver_.receipt();
    faults_.set_present(kLinkDeaf, receipt.unanswered >= kMostUnanswered);
    sent_.told(receipt);
    tell_held(sent_.held());
    state_.sequence = ++sequence_;
    state_.stamp_ns = stamp_ns;
    publish(true);
  } else {
    publish_changes();
  }
  note({.kind = LinkEventKind::kReport,
        .code = static_cast<std::uint8_t>(verdict_),
        .stamp_ns = now_ns,
        .number = sequence_,
        .bytes = bytes});
  if (observer_ != nullptr) observer_->on_report(now_ns, bytes, verdict_, sequence_);
}

void ReportFlow::tell_held(const HeldWrench& held) noexcept {
  held_force_n_.store(held.force_n, std::memory_order_relaxed);
  held_torque_nm_.store(held.torque_nm, std::memory_order_relaxed);
  held_until_ns_.store(0);
}

HeldWrench ReportFlow::held() const noexcept {
  const std::int64_t until_ns = held_until_ns_.load();
  if (until_ns != 0 && clock_ns() > until_ns) return {};
  return {held_force_n_.load(std::memory_order_relaxed),
          held_torque_nm_.load(std::memory_order_relaxed)};
}

std::string ReportFlow::defect(std::int64_t bus_interval_ns) const {
  DeviceCapabilities stated = driver_.capabilities();
  stated.bus_interval_ns = bus_interval_ns;
  return settings_.accept ? settings_.accept(stated) : std::string();
}

void ReportFlow::on_report_done() noexcept {
  if (settings_.answer_wait_ns > 0 && verdict_ == ReportVerdict::kState) wait_for_answer();
  timed_ = false;
  drive();
}

// Report-clocked: until the command that answers this report is there, but not for ever.
void ReportFlow::wait_for_answer() noexcept {
  const std::int64_t begin = now_ns();
  for (int look = 0; look < kMostAnswerLooks; ++look) {
    take_command();
    if (command_.tick != 0 && command_.sequence >= sequence_) return;
    // Not on the tape, which would be full of it: what was waited for is.
    if (clock_ns() - begin >= settings_.answer_wait_ns) break;
    if (settings_.clock == nullptr) sched_yield();
  }
  count_one(counters_.answers_late);
}

void ReportFlow::on_out_end(bool delivered) noexcept {
  if (delivered) {
    lost_sends_ = 0;
    faults_.set_present(kLinkSendFailed, false);
    zero_delivered_ = resting_ && out_zero_;
    at_rest_ = releasing_;
  } else {
    guard_.not_delivered();
    lose_send();
  }
  releasing_ = false;
  if ((owed_ || (zero_delivered_ && !at_rest_)) && !transfers_->lost()) drive();
}

void ReportFlow::lose_send() noexcept {
  if (++lost_sends_ >= kMostLostSends) faults_.set_present(kLinkSendFailed, true);
}

// One output: newest command, guard, driver, bus. The guard runs only when what it makes can be
// handed over, so that its last output is the device's last one.
void ReportFlow::drive() noexcept {
  const std::int64_t now = now_ns();
  driven_ns_ = now;
  take_command();
  follow_servo(now);
  follow_holder();
  follow_calls();
  follow_switches();
  latch_present();
  // Also where nothing can be sent now: the next report may be a good one again.
  const bool held = (state_.switches & settings_.deadman) == settings_.deadman;
  if (state_.link != LinkState::kReady || resting_ || !held) guard_.hold_back(command_);
  owed_ = transfers_->busy();
  if (owed_) {
    count_one(counters_.send_busy);
    return;
  }
  if (zero_delivered_) return release();
  GuardedOutput output = guard_.update(now, command_);
  wait_for_device(now, output);
  faults_.raise(output.faults & ~guard_faults_);
  guard_faults_ = output.faults;
  faults_.set_present(kLinkStaleCommand, (output.present & kLinkStaleCommand) != 0);
  if (output.held) count_one(counters_.guard_held);
  if (!send(now, output)) guard_.not_delivered();
  publish_changes();
}

// A device that was late, or deaf for some reports, takes the newest command alone: what was sent
// since the one that it has must not be more than one allowed step from it. Where it says nothing
// of late, or has said for too long that it hears nothing, the output goes on without it.
void ReportFlow::wait_for_device(std::int64_t now_ns, GuardedOutput& output) noexcept {
  constexpr std::uint32_t kBeyond = kLinkDeaf | kLinkSendFailed | kLinkFrozen | kLinkCorrupt;
  const Wrench* const device_d = sent_.accepted();
  const std::int64_t longest_ns = std::max(period_ns_, stated_.report_period_ns) *
                                  (1 + std::int64_t{settings_.limits.held_periods});
  if (device_d == nullptr || (faults_.present() & kBeyond) != 0 ||
      now_ns - state_.stamp_ns > longest_ns || !guard_.runs_ahead_of(*device_d))
    return;
  guard_.stay();
  output.wrench_d = guard_.last();
}

bool ReportFlow::send(std::int64_t now_ns, const GuardedOutput& output) noexcept {
  const std::span<std::uint8_t> room = transfers_->out_bytes();
  if (room.empty()) return true;  // reports go in only
  Wrench delivered_d;
  const std::size_t size = driver_.write(output.wrench_d, output.tick, room, delivered_d);
  if (size == 0) {
    at_rest_ = resting_ && is_zero(output.wrench_d);  // the device is not spoken to at all
    return false;
  }
  if (transfers_->send(size) != SendOutcome::kSent) {
    lose_send();
    return false;
  }
  count_one(counters_.sent);
  out_since_ns_ = now_ns;
  out_zero_ = is_zero(output.wrench_d);
  guard_.delivered(delivered_d);
  sent_.sent(delivered_d, driver_.receipt());
  tell_held(sent_.held());
  state_.accepted_d = record_of(delivered_d);
  state_.accepted_tick = output.tick;
  note({.kind = LinkEventKind::kSend,
        .stamp_ns = now_ns,
        .number = output.tick,
        .bytes = room.first(size)});
  if (observer_ != nullptr) observer_->on_send(now_ns, room.first(size), output);
  return true;
}

// A zero has arrived: nothing but what switches the drives off follows it.
void ReportFlow::release() noexcept {
  const std::span<std::uint8_t> room = transfers_->out_bytes();
  const std::size_t size = driver_.release(command_.tick, room);
  if (size == 0) {
    at_rest_ = true;
    return;
  }
  if (transfers_->send(size) != SendOutcome::kSent) return lose_send();
  releasing_ = true;
  count_one(counters_.sent);
  const std::int64_t now = now_ns();
  out_since_ns_ = now;
  GuardedOutput output;
  output.tick = command_.tick;
  output.faults = guard_.faults();
  note({.kind = LinkEventKind::kSend,
        .stamp_ns = now,
        .number = output.tick,
        .bytes = room.first(size)});
  if (observer_ != nullptr) observer_->on_send(now, room.first(size), output);
}

void ReportFlow::follow_calls() noexcept {
  std::uint32_t seen = 0;
  if (stop_called_.exchange(false, std::memory_order_acq_rel)) {
    note({.kind = LinkEventKind::kStopCalled});
    seen |= kLinkStopCalled;
  }
  if (const std::int64_t slept = slept_ns(); slept - slept_ns_ > kShortestSleep_ns) {
    note({.kind = LinkEventKind::kSuspended, .number = static_cast<std::uint64_t>(slept)});
    slept_ns_ = slept;
    seen |= kLinkSuspended;
  }
  if (seen == 0) return;
  guard_.hold_back(command_);  // what was armed before does not count
  guard_.latch(seen);
  guard_faults_ |= seen;
  faults_.raise(seen);
}

void ReportFlow::follow_switches() noexcept {
  if (settings_.switches == nullptr) return;
  const std::uint32_t pressed = settings_.switches->pressed() & kInputSwitch;
  if (pressed != outer_switches_) note({.kind = LinkEventKind::kSwitches, .number = pressed});
  outer_switches_ = pressed;
  state_.switches = (state_.switches & ~kInputSwitch) | pressed;
}

// After a new state alone: a report that was refused says nothing of the gripper.
void ReportFlow::follow_gripper() noexcept {
  const std::optional<Real> gap_m = driver_.gap_m();
  gap_m_.store(gap_m ? static_cast<double>(*gap_m) : -1.0, std::memory_order_relaxed);
  if (!settings_.gripper.is_used()) return;
  const bool closed = gripper_.closed(gap_m);
  state_.switches = (state_.switches & ~kClosedGripper) | (closed ? kClosedGripper : 0u);
}

// Fills in the state of a device whose silence means rest, once a period.
void ReportFlow::fill_silence(std::int64_t now_ns) noexcept {
  if (now_ns - state_.stamp_ns < period_ns_ || !driver_.rest(now_ns, state_)) return;
  faults_.heard(now_ns);
  follow_switches();
  state_.sequence = ++sequence_;
  state_.stamp_ns = now_ns;
  publish(true);
}

void ReportFlow::follow_servo(std::int64_t now_ns) noexcept {
  if (servo_lost_.exchange(false, std::memory_order_acq_rel)) {
    note({.kind = LinkEventKind::kServoLost});
    servo_lost_ns_ = now_ns;
    guard_.hold_back(command_);
    guard_.latch(kLinkServoLost);
    faults_.set_present(kLinkServoLost, true);
  }
  // Another servo process has come.
  if (command_.tick != 0 && command_.stamp_ns > servo_lost_ns_)
    faults_.set_present(kLinkServoLost, false);
}

// The zero command is the holder's from the first report on that can be relied upon. Where it has
// sent one, the device has zero, no matter what went before.
void ReportFlow::follow_holder() noexcept {
  ZeroHolder* const holder = settings_.zero_holder;
  if (holder == nullptr) return;
  if (!zero_held_ && state_.link == LinkState::kReady) {
    zero_held_ = true;
    zeros_sent_ = holder->sent();
    ZeroCommand command = transfers_->zero_target();
    command.size = static_cast<std::uint32_t>(driver_.zero_report(command.bytes));
    command.watchdog_ns = driver_.capabilities().watchdog_ns;
    if (command.descriptor >= 0 && command.size > 0) holder->hold(command);
  }
  const std::uint32_t sent = holder->sent();
  if (!zero_held_ || sent == zeros_sent_) return;
  zeros_sent_ = sent;
  guard_.restart();
  guard_.latch(kLinkStaleCommand);
}

// A fault of the link does not wait for the servo thread to see it; and while it is there, what was
// armed before, seen or not, does not count.
void ReportFlow::latch_present() noexcept {
  if (faults_.present() == 0) return;
  take_command();
  guard_.hold_back(command_);
  const std::uint32_t wrong = faults_.present() & ~guard_.faults();
  guard_.latch(wrong);
  guard_faults_ |= wrong;
}

void ReportFlow::turn() noexcept {
  const std::int64_t now = now_ns();
  const bool due = until_turn_ns() == 0;
  if (due) fill_silence(now);
  faults_.check_silence(now);
  if (transfers_->busy() && now - out_since_ns_ > settings_.silence_ns) {
    faults_.set_present(kLinkSendFailed, true);
    out_since_ns_ = now;
    transfers_->cancel_out();
  }
  latch_present();
  if (due) {
    timed_ = true;
    drive();
  }
  publish_changes();
}

// A report may be late by a quarter of a period before time takes over: sending just before it
// comes would find the transfer busy when it does.
std::int64_t ReportFlow::until_turn_ns() const noexcept {
  const std::int64_t due_ns = driven_ns_ + (timed_ ? period_ns_ : period_ns_ + period_ns_ / 4);
  const std::int64_t now = now_ns();
  return due_ns > now ? due_ns - now : 0;
}

void ReportFlow::begin_rest() noexcept {
  resting_ = true;
  at_rest_ = transfers_->out_bytes().empty();
}

bool ReportFlow::is_at_rest() const noexcept { return at_rest_; }

}  // namespace haptic::hal
