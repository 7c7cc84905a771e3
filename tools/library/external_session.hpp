// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A session whose device and loop are the caller's: each tick is a call of that loop, on its
/// thread and by its clock. Limits, arming, checks and ramps are those of the servo group; what any
/// thread may read or move is that of every session.

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>

#include "rt_core/servo_tick.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/library/caller_tick.hpp"
#include "tools/library/haptic.h"
#include "tools/library/open_session.hpp"
#include "tools/library/session_parts.hpp"
#include "tools/library/tick_notes.hpp"

namespace haptic::tools {

class ExternalSession final : public OpenSession {
 public:
  /// @param scene  opened before, with one hand. `options`: checked.
  ExternalSession(std::span<const std::byte> scene, const haptic_servo_options& options,
                  double history_s);
  ~ExternalSession() override { close(); }

  /// The thread of the caller's loop. HAPTIC_OK; HAPTIC_ERROR_BUSY: another thread is in it;
  /// HAPTIC_ERROR_CLOSED: closed, and the force is zero. No heap, lock, or system call but the
  /// clock's.
  [[nodiscard]] int tick(const haptic_servo_input& input,
                         haptic_servo_output& output) noexcept override;

  /// Those of the last tick, on its thread or between ticks. As `tick`; HAPTIC_ERROR_PART;
  /// HAPTIC_ERROR_SCENE: the law has no planes.
  [[nodiscard]] int contacts(std::span<haptic_contact> contacts, std::size_t& count,
                             Wrench& rest) noexcept override;

  /// Ticks ramp to zero from now on, and the last of them ends the session. Called on another
  /// thread than the loop's it waits for that, 0.5 s at most, as long as the loop goes on.
  void close() noexcept override;
  [[nodiscard]] bool closed() const noexcept override { return closed_.load(); }
  [[nodiscard]] std::size_t count() const noexcept override { return 1; }

  void state(std::size_t hand, haptic_state& state) const noexcept override;
  [[nodiscard]] SessionVerdict verdict(std::size_t /*hand*/) const noexcept override {
    return notes_.verdict();
  }
  [[nodiscard]] std::size_t history(std::size_t /*hand*/,
                                    std::span<haptic_tick> ticks) const override {
    return notes_.history(ticks, opened_ns_);
  }
  void gains(haptic_gains& gains) const noexcept override;
  void device(std::size_t hand, haptic_device_status& status) const noexcept override;
  /// It has none.
  [[nodiscard]] std::size_t events(std::span<haptic_event> /*events*/) const noexcept override {
    return 0;
  }
  [[nodiscard]] int move_hand(const haptic_hand_goal& /*goal*/,
                              std::uint64_t& /*number*/) override {
    return HAPTIC_ERROR_DEVICE;
  }
  [[nodiscard]] int hold(std::size_t /*hand*/, haptic_hold /*hold*/) override {
    return HAPTIC_ERROR_DEVICE;
  }
  [[nodiscard]] int hold_part(std::uint32_t part) override {
    return parts_.hold_part(part, parameters_.limits.period_ns, closed_);
  }
  [[nodiscard]] int release_part() override { return parts_.release_part(); }
  [[nodiscard]] std::size_t bodies(std::span<haptic_body> bodies) const override {
    return parts_.bodies(notes_.held(), bodies);
  }
  /// Stamped with the time of the newest tick: the two clocks need not be one.
  [[nodiscard]] int move_fixed(const haptic_frame& frame) override;
  [[nodiscard]] int drive(std::uint32_t part, const haptic_frame& frame) override;
  [[nodiscard]] std::size_t driven(std::span<haptic_driven> driven) const noexcept override {
    return write_driven(notes_.held(), driven);
  }
  void stop() noexcept override { stop_.store(true); }

 private:
  /// For the time of one call of the loop.
  struct Turn {
    explicit Turn(std::atomic<bool>& flag) noexcept
        : busy(flag), is_mine(!flag.exchange(true, std::memory_order_acquire)) {}
    // Release: the next one finds what this one has written.
    ~Turn() {
      if (is_mine) busy.store(false, std::memory_order_release);
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    std::atomic<bool>& busy;
    bool is_mine;
  };
  void count(std::int64_t passed_ns, std::int64_t begin_ns) noexcept;
  [[nodiscard]] std::int64_t silence_ns() const noexcept;

  SceneBytes scene_;
  SceneView view_;
  ServoParameters parameters_;
  SessionParts parts_;
  TickNotes notes_;
  std::int64_t opened_ns_;
  // The thread of the loop.
  std::optional<ServoTick> tick_;
  CallersTime time_;
  NewestReader<FrameRecord> frames_;
  std::array<std::optional<NewestReader<FrameRecord>>, kMostDriven> driven_;
  std::array<FrameRecord, kMostDriven> newest_driven_;
  LoopCounts counts_;
  std::uint64_t last_report_ = 0;
  ServoResult result_;
  std::atomic<bool> busy_{false}, stop_{false}, closed_{false}, is_over_{false};
  std::atomic<int> loop_thread_{0};           ///< of the last tick
  std::atomic<std::int64_t> ticked_ns_{0};    ///< its begin, by the clock of this machine; 0: none
  std::atomic<std::int64_t> tick_now_ns_{0};  ///< its time, by that of the ticks
  std::atomic<std::uint64_t> reports_{0};
  std::atomic<std::uint32_t> waits_{0}, faults_{0};  ///< ArmingWait and SafetyFault
};

}  // namespace haptic::tools
