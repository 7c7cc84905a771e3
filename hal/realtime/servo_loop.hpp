// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The servo thread's body: wait, newest state, tick, publish. Clocked by a timer with the phase
/// kept, or by the reports of the device. Two devices, each with a hand of one scene, have one
/// loop.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>

#include "hal/clock/servo_clock.hpp"
#include "hal/device_mailbox.hpp"
#include "rt_core/exchange/newest_record.hpp"
#include "rt_core/servo_tick.hpp"
#include "rt_core/two_hand_tick.hpp"

namespace haptic::hal {

struct ServoLoopSettings {
  std::int64_t period_ns = 1'000'000;
  /// Tick at each report, of two devices of the first; a report that does not come within
  /// `report_wait_ns` is waited for no longer, so that the output decays and ramps on its own.
  bool report_clocked = false;
  std::int64_t report_wait_ns = 1'500'000;
  /// Time that the ticks get; null: CLOCK_MONOTONIC. A simulated device brings its own. Sleeps
  /// always go by the monotonic clock.
  std::int64_t (*clock)(void* context) = nullptr;
  void* clock_context = nullptr;
  bool report_goal_contact = false;  ///< as in StepInput, of every tick
  /// Frames of the fixed parts, by the clock of the ticks; null: these stand still.
  const NewestRecord<FrameRecord>* frames = nullptr;
  /// Poses of each driven part, by the same clock; at most kMostDriven.
  std::span<const NewestRecord<FrameRecord>> driven;
};

/// Ticks by what was found, since the start; states of the first device. Written by the servo
/// thread alone.
struct ServoLoopCounters {
  std::uint64_t ticks = 0;
  std::uint64_t late = 0;            ///< woken at least a period late
  std::uint64_t missed_periods = 0;  ///< deadlines that passed without a tick
  std::uint64_t without_state = 0;   ///< no new state since the tick before
  std::int64_t largest_lateness_ns = 0, largest_tick_ns = 0;
  std::int64_t last_lateness_ns = 0, last_tick_ns = 0;  ///< a watch sees its tick, and that before
};

/// Called after each tick on the servo thread, with what went in and what came out: tests, rings.
/// Must be wait-free.
using TickWatch = void (*)(void* context, const ServoInput& input, const ServoResult& result);

/// Owner: the servo thread. Tick and mailbox outlive it. No heap, no lock; system calls of `run`:
/// the clock, and the sleep between ticks.
class ServoLoop {
 public:
  ServoLoop(ServoTick& tick, const DeviceMailbox& mailbox,
            const ServoLoopSettings& settings) noexcept
      : ServoLoop(&tick, nullptr, settings) {
    seats_[0].mailbox.emplace(mailbox);
  }
  /// For two devices.
  ServoLoop(TwoHandTick& tick, const std::array<const DeviceMailbox*, kMostHands>& mailboxes,
            const ServoLoopSettings& settings) noexcept
      : ServoLoop(nullptr, &tick, settings) {
    for (std::size_t k = 0; k < kMostHands; ++k) seats_[k].mailbox.emplace(*mailboxes[k]);
  }

  void watch(TickWatch called, void* context, std::size_t hand = 0) noexcept {
    seats_[hand].watch = called;
    seats_[hand].watch_context = context;
  }

  /// One tick at `now_ns`: newest state, step, publish. `late_periods`: whole periods missed.
  /// @return result() of the first device.
  const ServoResult& tick(std::int64_t now_ns, std::uint32_t late_periods) noexcept;
  /// The last tick's.
  [[nodiscard]] const ServoResult& result(std::size_t hand = 0) const noexcept {
    return seats_[hand].result;
  }

  /// In place of the command that the last tick has published; on the servo thread.
  void publish_instead(const DeviceCommand& command, std::size_t hand = 0) noexcept {
    seats_[hand].mailbox->publish(command);
  }

  /// Ticks until `stop`. Returns 0, or the errno of a sleep that failed.
  int run(const std::atomic<bool>& stop) noexcept;

  /// From any thread: the call in addition to the device's own e-stop input; latches.
  void emergency_stop() noexcept { emergency_stop_.store(true, std::memory_order_relaxed); }

  [[nodiscard]] const ServoLoopCounters& counters() const noexcept { return counters_; }

 private:
  /// A device, and its tick.
  struct Seat {
    std::optional<ServoSide> mailbox;
    ServoInput input;
    ServoResult result;
    TickWatch watch = nullptr;
    void* watch_context = nullptr;
  };

  ServoLoop(ServoTick* one, TwoHandTick* two, const ServoLoopSettings& settings) noexcept
      : one_(one), two_(two), settings_(settings) {
    if (settings.frames != nullptr) frames_.emplace(*settings.frames);
    driven_count_ = std::min<std::size_t>(settings.driven.size(), kMostDriven);
    for (std::size_t k = 0; k < driven_count_; ++k) driven_[k].emplace(settings.driven[k]);
  }
  [[nodiscard]] std::span<Seat> seats() noexcept {
    return std::span(seats_).first(two_ != nullptr ? kMostHands : 1);
  }
  void step() noexcept;
  [[nodiscard]] std::int64_t now_ns() const noexcept {
    return settings_.clock != nullptr ? settings_.clock(settings_.clock_context) : monotonic_ns();
  }
  void note_wake(std::int64_t lateness_ns) noexcept;
  void note_end(std::int64_t tick_ns) noexcept;
  int run_by_timer(const std::atomic<bool>& stop) noexcept;
  int run_by_reports(const std::atomic<bool>& stop) noexcept;

  ServoTick* one_;
  TwoHandTick* two_;  ///< one of the two is null
  std::array<Seat, kMostHands> seats_;
  ServoLoopSettings settings_;
  std::optional<NewestReader<FrameRecord>> frames_;
  std::array<std::optional<NewestReader<FrameRecord>>, kMostDriven> driven_;
  std::array<FrameRecord, kMostDriven> newest_driven_;
  std::size_t driven_count_ = 0;
  ServoLoopCounters counters_;
  std::atomic<bool> emergency_stop_{false};
};

}  // namespace haptic::hal
