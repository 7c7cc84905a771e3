// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/haply/haply_session.hpp"

#include <pthread.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "hal/clock/linux_process.hpp"
#include "hal/clock/servo_clock.hpp"

namespace haptic::tools {
namespace {

/// A device without a write for so many periods has its drives off, whether or not it was released.
constexpr std::int64_t kNoWrite_periods = 50;
constexpr std::int64_t kGoodbye_ns = 50'000'000;
/// Texts that are passed over before a question.
constexpr int kMostUnasked = 16;
/// A force of this size, of which the service exerts less than a tenth, for so many answers, goes
/// nowhere: filters of the service take less of it.
constexpr double kPlainForce_n = 0.2;
constexpr unsigned kNotTakenAnswers = 100;
/// Between the force that the service says it exerts and the one that it was sent [N].
constexpr double kSameForce_n = 0.3;

/// From `p` to the nearest point between zero and `end`.
double distance_to_segment(const double (&p)[3], const double (&end)[3]) noexcept {
  double along = 0, square = 0, rest = 0;
  for (int k = 0; k < 3; ++k) {
    along += p[k] * end[k];
    square += end[k] * end[k];
  }
  const double share = square > 0 ? std::clamp(along / square, 0.0, 1.0) : 0.0;
  for (int k = 0; k < 3; ++k) rest += (p[k] - share * end[k]) * (p[k] - share * end[k]);
  return std::sqrt(rest);
}

}  // namespace

void put_state(const HaplyState& state, HaplyReport& report) noexcept {
  std::copy(std::begin(state.position_m), std::end(state.position_m), report.position_m);
  std::copy(std::begin(state.velocity_m_per_s), std::end(state.velocity_m_per_s),
            report.velocity_m_per_s);
  std::copy(std::begin(state.q_xyzw), std::end(state.q_xyzw), report.q_xyzw);
  report.buttons = state.buttons;
  report.has_velocity = state.has_velocity ? 1 : 0;
  report.calibrated = state.calibrated ? 1 : 0;
  report.moved = state.moved ? 1 : 0;
  report.grip_awake = state.grip_awake ? 1 : 0;
}

HaplyParsed parsed_bytes(HaplyReport report) noexcept {
  report.answered_ns = report.grip_ns = 0;
  report.wrong = report.verdict = 0;
  report.cut = HaplyCut::kNone;
  report.end = HaplyEnd::kNone;
  return std::bit_cast<HaplyParsed>(report);
}

bool OtherForce::look(const double (&exerted_n)[3]) noexcept {
  const bool is_ours = std::any_of(std::begin(sent_n_), std::end(sent_n_), [&](const auto& sent) {
    return distance_to_segment(exerted_n, sent) <= kSameForce_n;
  });
  foreign_ = is_ours ? 0 : std::min(foreign_ + 1, kAnswers);
  return foreign_ >= kAnswers;
}

void OtherForce::sent(const double (&force_n)[3]) noexcept {
  std::copy(std::begin(force_n), std::end(force_n), sent_n_[at_++ % kRemembered]);
}

HaplySession::HaplySession(std::unique_ptr<ServiceSocket> socket, HaplyFormat format,
                           HaplyChoice choice, HaplyTimes times, bool accepts_other_forces,
                           std::shared_ptr<hal::DeviceTap> tap)
    : socket_(std::move(socket)),
      format_(format),
      choice_(std::move(choice)),
      times_(times),
      accepts_other_forces_(accepts_other_forces),
      tap_(std::move(tap)),
      wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  // Signals are the program's own, and go to its threads.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { run(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

HaplySession::~HaplySession() {
  is_over_.store(true, std::memory_order_relaxed);
  thread_.join();
  if (wake_ >= 0) ::close(wake_);
}

void HaplySession::run() {
  static_cast<void>(hal::set_timer_slack(1));
  std::int64_t next_ns = hal::monotonic_ns();
  while (!is_over_.load(std::memory_order_relaxed) && exchange()) {
    next_ns = std::max(next_ns + times_.period_ns, hal::monotonic_ns());
    hal::sleep_until(next_ns);
  }
  say_goodbye();
}

void HaplySession::cut(HaplyCut why) noexcept {
  if (report_.cut == HaplyCut::kNone) report_.cut = why;
}

bool HaplySession::end(HaplyEnd why) noexcept {
  report_.end = why;
  publish();
  return false;
}

void HaplySession::publish() noexcept {
  said_.publish(report_);
  const std::uint64_t one = 1;
  // Full is as good as written: who waits is awake.
  if (wake_ >= 0) static_cast<void>(!::write(wake_, &one, sizeof one));
}

bool HaplySession::choose(std::int64_t now_ns, double (&force_n)[3]) {
  force_ = heard_.newest();
  std::fill(std::begin(force_n), std::end(force_n), 0.0);
  const bool is_on =
      force_.is_on != 0 && now_ns - force_.handed_ns < kNoWrite_periods * times_.period_ns;
  if (is_foreign_) cut(HaplyCut::kOtherForce);
  if (!state_.powered) cut(HaplyCut::kUnpowered);
  if (!is_on) {
    // Off once: whoever arms again starts from zero.
    if (!is_foreign_ && state_.powered && is_zero_) report_.cut = HaplyCut::kNone;
    return true;
  }
  if (report_.cut != HaplyCut::kNone) return true;
  if (now_ns - force_.handed_ns > times_.old_ns()) {
    if (now_ns - sent_ns_ <= times_.cut_ns()) return false;
    cut(HaplyCut::kLate);
    return true;
  }
  const bool is_finite = std::all_of(std::begin(force_.force_n), std::end(force_.force_n),
                                     [](double x) { return std::isfinite(x); });
  if (is_finite)
    std::copy(std::begin(force_.force_n), std::end(force_.force_n), force_n);
  else
    cut(HaplyCut::kBadForce);
  return true;
}

bool HaplySession::exchange() {
  const std::int64_t now_ns = hal::monotonic_ns();
  double force_n[3];
  if (!choose(now_ns, force_n)) return true;
  if (!pass_over_texts()) return false;
  write_haply_force(format_, choice_.device, force_n, is_first_, out_);
  if (!socket_->send(out_, now_ns + times_.cut_ns())) return end(HaplyEnd::kNotSent);
  other_.sent(force_n);
  is_first_ = false;
  is_zero_ = force_n[0] == 0 && force_n[1] == 0 && force_n[2] == 0;
  asked_n_ = std::sqrt(force_n[0] * force_n[0] + force_n[1] * force_n[1] + force_n[2] * force_n[2]);
  sent_ns_ = now_ns;
  in_flight_ns_.store(now_ns, std::memory_order_relaxed);
  sent_release_ = force_.is_on == 0 ? force_.release : sent_release_;
  return take_answer();
}

/// A text that is there before the question is no answer to it: taken for one, it would put each
/// later answer one question behind. False: the connection has ended.
bool HaplySession::pass_over_texts() {
  for (int k = 0; k < kMostUnasked; ++k) {
    const ServiceSocket::Got got = socket_->receive(in_, 0);
    if (got == ServiceSocket::Got::kNothing) return true;
    if (got == ServiceSocket::Got::kClosed) return end(HaplyEnd::kClosed);
    if (got == ServiceSocket::Got::kTooLong) return end(HaplyEnd::kTooLong);
  }
  return true;
}

bool HaplySession::take_answer() {
  for (;;) {
    const std::int64_t now_ns = hal::monotonic_ns();
    const ServiceSocket::Got got = socket_->receive(in_, now_ns + times_.cut_ns());
    if (got == ServiceSocket::Got::kClosed) return end(HaplyEnd::kClosed);
    if (got == ServiceSocket::Got::kTooLong) return end(HaplyEnd::kTooLong);
    if (got == ServiceSocket::Got::kText) break;
    if (now_ns - sent_ns_ > kHaplyGone_ns) return end(HaplyEnd::kNoAnswer);
    if (is_over_.load(std::memory_order_relaxed)) return false;
  }
  in_flight_ns_.store(0, std::memory_order_relaxed);
  // A stall with the drives off hurts nobody.
  const bool is_late = hal::monotonic_ns() - sent_ns_ > times_.cut_ns();
  if (is_late && (!is_zero_ || heard_.newest().is_on != 0)) cut(HaplyCut::kStalled);

  const HaplyVerdict verdict = read_haply_state(in_, choice_, state_);
  if (verdict == HaplyVerdict::kOk) put_state(state_, report_);
  if (tap_ != nullptr)
    tap_->note(hal::TapKind::kParsed, static_cast<std::int64_t>(verdict), {},
               parsed_bytes(report_));
  if (verdict == HaplyVerdict::kOk) {
    wrong_in_row_ = absent_in_row_ = 0;
    take_state(state_);
    return true;
  }
  ++report_.wrong;
  report_.verdict = static_cast<std::uint64_t>(verdict);
  if (verdict == HaplyVerdict::kAbsent) {
    if (++absent_in_row_ >= kMostHaplyErrors) return end(HaplyEnd::kUnplugged);
  } else if (++wrong_in_row_ >= kMostHaplyErrors) {
    return end(HaplyEnd::kErrors);
  }
  return true;
}

bool HaplySession::is_not_taken(const HaplyState& state) noexcept {
  const double exerted_n =
      std::sqrt(state.force_n[0] * state.force_n[0] + state.force_n[1] * state.force_n[1] +
                state.force_n[2] * state.force_n[2]);
  const bool is_lost = state.has_force && asked_n_ > kPlainForce_n && exerted_n < 0.1 * asked_n_;
  not_taken_ = is_lost ? std::min(not_taken_ + 1, kNotTakenAnswers) : 0;
  return not_taken_ >= kNotTakenAnswers;
}

void HaplySession::take_state(const HaplyState& state) {
  report_.answered_ns = hal::monotonic_ns();
  if (state.has_grip) report_.grip_ns = report_.answered_ns;
  is_foreign_ = !accepts_other_forces_ && state.has_force && other_.look(state.force_n);
  if (is_foreign_) cut(HaplyCut::kOtherForce);
  if (!state.powered) cut(HaplyCut::kUnpowered);
  if (is_not_taken(state)) cut(HaplyCut::kNotTaken);
  // Release: who sees the number finds the force gone.
  if (is_zero_) released_.store(sent_release_, std::memory_order_release);
  publish();
}

void HaplySession::say_goodbye() {
  // Behind the message in flight: a service that stalls reads this next.
  const double zero[3] = {0, 0, 0};
  write_haply_force(format_, choice_.device, zero, false, out_);
  const std::int64_t until_ns = hal::monotonic_ns() + kGoodbye_ns;
  if (!socket_->send(out_, until_ns)) return;
  for (int answers = in_flight_ns_.load(std::memory_order_relaxed) != 0 ? 2 : 1; answers > 0;
       --answers)
    if (socket_->receive(in_, until_ns) != ServiceSocket::Got::kText) return;
  released_.store(~std::uint64_t{0}, std::memory_order_release);
  socket_->close(until_ns + kGoodbye_ns);
}

}  // namespace haptic::tools
