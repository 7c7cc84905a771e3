// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/servo_loop.hpp"

#include <algorithm>
#include <limits>

namespace haptic::hal {
namespace {

std::uint32_t narrowed(std::int64_t periods) noexcept {
  constexpr std::int64_t kMost = std::numeric_limits<std::uint32_t>::max();
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(periods, 0, kMost));
}

}  // namespace

void ServoLoop::step() noexcept {
  if (two_ == nullptr) {
    seats_[0].result = one_->step(seats_[0].input);
    return;
  }
  const std::array<ServoResult, kMostHands> results =
      two_->step({seats_[0].input, seats_[1].input});
  for (std::size_t k = 0; k < kMostHands; ++k) seats_[k].result = results[k];
}

const ServoResult& ServoLoop::tick(std::int64_t now_ns, std::uint32_t late_periods) noexcept {
  FrameRecord frame;
  if (frames_) frame = frames_->newest();
  for (std::size_t k = 0; k < driven_count_; ++k) newest_driven_[k] = driven_[k]->newest();
  const bool stops = emergency_stop_.exchange(false, std::memory_order_relaxed);
  bool is_new = false, is_first_new = false;
  for (Seat& seat : seats()) {
    seat.input.state = seat.mailbox->state(&is_new);
    if (&seat == seats_.data()) is_first_new = is_new;
    seat.input.now_ns = now_ns;
    seat.input.late_periods = late_periods;
    seat.input.report_goal_contact = settings_.report_goal_contact;
    seat.input.frame = frame;
    seat.input.driven = std::span(newest_driven_).first(driven_count_);
    seat.input.emergency_stop = stops;
  }
  step();
  for (Seat& seat : seats()) seat.mailbox->publish(seat.result.command);
  counters_.ticks += 1;
  counters_.late += late_periods > 0 ? 1u : 0u;
  counters_.missed_periods += late_periods;
  counters_.without_state += is_first_new ? 0u : 1u;
  for (const Seat& seat : seats())
    if (seat.watch != nullptr) seat.watch(seat.watch_context, seat.input, seat.result);
  return seats_[0].result;
}

void ServoLoop::note_wake(std::int64_t lateness_ns) noexcept {
  counters_.last_lateness_ns = lateness_ns;
  counters_.largest_lateness_ns = std::max(counters_.largest_lateness_ns, lateness_ns);
}

void ServoLoop::note_end(std::int64_t tick_ns) noexcept {
  counters_.last_tick_ns = tick_ns;
  counters_.largest_tick_ns = std::max(counters_.largest_tick_ns, tick_ns);
}

int ServoLoop::run(const std::atomic<bool>& stop) noexcept {
  return settings_.report_clocked ? run_by_reports(stop) : run_by_timer(stop);
}

int ServoLoop::run_by_timer(const std::atomic<bool>& stop) noexcept {
  DeadlineSchedule schedule(monotonic_ns(), settings_.period_ns);
  while (!stop.load(std::memory_order_relaxed)) {
    const int error = sleep_until(schedule.next_deadline_ns());
    if (error != 0) return error;
    const std::int64_t start_ns = monotonic_ns();
    const std::int64_t missed = schedule.advance(start_ns);
    note_wake(schedule.last_lateness_ns());
    tick(now_ns(), narrowed(missed));
    note_end(monotonic_ns() - start_ns);
  }
  return 0;
}

int ServoLoop::run_by_reports(const std::atomic<bool>& stop) noexcept {
  std::uint32_t seen = seats_[0].mailbox->states_published();
  std::int64_t last_ns = now_ns();
  while (!stop.load(std::memory_order_relaxed)) {
    const std::int64_t deadline_ns = monotonic_ns() + settings_.report_wait_ns;
    std::uint32_t count = seen;
    while (count == seen && monotonic_ns() < deadline_ns && !stop.load(std::memory_order_relaxed)) {
      count = seats_[0].mailbox->wait_for_state(seen, deadline_ns);
    }
    seen = count;
    const std::int64_t start_ns = now_ns();
    // The reports are the clock: what counts as late is the time since the last tick.
    const std::int64_t over = start_ns - last_ns - settings_.period_ns;
    note_wake(over);
    last_ns = start_ns;
    tick(start_ns, narrowed(over / settings_.period_ns));
    note_end(now_ns() - start_ns);
  }
  return 0;
}

}  // namespace haptic::hal
