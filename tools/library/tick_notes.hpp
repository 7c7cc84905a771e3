// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Kept of the ticks of a device in this process, for any thread to read: the newest one,
/// the judgement, and the history.

#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/exchange/newest_record.hpp"
#include "rt_core/servo_tick.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/library/bodies.hpp"
#include "tools/library/haptic.h"
#include "tools/session/session_records.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {

/// Counts of the loop, and the time of a tick since the session was opened.
struct LoopCounts {
  std::uint64_t ticks = 0, late = 0, missed_periods = 0;
  std::int64_t largest_tick_ns = 0, since_opened_ns = 0;
};

/// Owner: that of the session. `state`, `verdict`, `held` and `history` from any thread.
class TickNotes {
 public:
  /// `parameters`: of the tick, its grip point and start from the scene.
  TickNotes(const SceneView& scene, const ServoParameters& parameters, double history_s);
  TickNotes(const TickNotes&) = delete;
  TickNotes& operator=(const TickNotes&) = delete;

  [[nodiscard]] FlightRecorder& recorder() noexcept { return recorder_; }

  /// Servo thread: takes a tick, and `publish` makes it the newest; between them the caller may add
  /// to the state.
  haptic_state& take(const ServoInput& input, const ServoResult& result, const LoopCounts& counts,
                     const HeldNow& held) noexcept;
  void publish() noexcept { writer_.publish(taken_); }

  void state(haptic_state& state) const noexcept;
  [[nodiscard]] SessionVerdict verdict() const noexcept { return newest().verdict; }
  [[nodiscard]] HeldNow held() const noexcept { return newest().held; }
  /// As many as there is room for. @return how many. Allocates.
  [[nodiscard]] std::size_t history(std::span<haptic_tick> ticks, std::int64_t opened_ns) const;

 private:
  /// As the servo thread leaves it after a tick.
  struct NewestTick {
    haptic_state state = HAPTIC_STATE_INIT;
    SessionVerdict verdict;
    HeldNow held;
    std::uint64_t began_tick = 0;  ///< in which the part began last
    MapRecord map;                 ///< found then
  };
  static_assert(sizeof(NewestTick) % sizeof(RecordWord) == 0);
  [[nodiscard]] NewestTick newest() const noexcept;

  ServoParameters parameters_;
  SceneBytes history_memory_;
  FlightRecorder recorder_;
  // Servo thread.
  SessionJudge judge_;
  WorkspaceMap map_;
  NewestTick taken_;
  NewestRecord<NewestTick> record_;
  NewestWriter<NewestTick> writer_{record_};
};

}  // namespace haptic::tools
