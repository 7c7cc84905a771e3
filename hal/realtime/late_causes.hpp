// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Why a tick of the servo loop was late: the machine woke the thread late, the tick had too much
/// to do, the machine took the core away within it, or no report was there to rest on.

#include <array>
#include <cstddef>
#include <cstdint>

#include "rt_core/servo_tick.hpp"

namespace haptic::hal {

/// A tick is late if its command is published after the end of its period. Then the cause is
/// - kTick, if its work and what it had to wait for of the work of the ticks before alone are
/// longer
///   than the period: on a machine without any delay it would have been late too;
/// - else kWakeUp or kHeldUp, the longer of the two, if the machine's delays are at least as long
///   as the work;
/// - else kTogether: most of the time is work that fits, and the machine's delay is too long for
///   what it leaves.
/// A tick in time is kReport if the state that it rests on is late.
enum class LateCause : std::uint8_t {
  kInTime = 0,
  kWakeUp,    ///< machine: woken late
  kTick,      ///< ours: too much work
  kReport,    ///< device or bus: no report, or a late one
  kHeldUp,    ///< machine: the tick took longer than its work
  kTogether,  ///< machine and work, neither alone
  kCount
};
inline constexpr std::size_t kLateCauses = static_cast<std::size_t>(LateCause::kCount);
/// Ticks by their cause.
using CauseCounts = std::array<std::uint64_t, kLateCauses>;

/// "in_time", "wake_up", "tick", "report", "held_up", "together".
[[nodiscard]] const char* to_text(LateCause cause) noexcept;

/// The cause of each tick, one after the other: a tick that starts late because the one before took
/// long has the cause of that one. O(1), no heap, no clock. Owner: one thread.
class LateJudge {
 public:
  /// `period_ns` of the loop, above 0.
  LateJudge(std::int64_t period_ns, bool report_clocked) noexcept
      : period_ns_(period_ns), report_clocked_(report_clocked) {}

  /// A tick begins with `input`, whose now_ns is on the clock of the stamps, `late_ns` after its
  /// deadline (ServoLoopCounters::last_lateness_ns); clocked by reports it is due when its report
  /// is complete, and `late_ns` is not looked at. A report is late
  /// - by the timer: if the newest state is two report periods old, or two of the loop's if those
  ///   are longer: then the tick holds its output (ServoTick);
  /// - by reports: if none came, or one and a half report periods after the one before.
  void begin(const ServoInput& input, std::int64_t late_ns) noexcept;

  /// It has taken `tick_ns`, of which `work_ns` are its own; negative: not known, all of it.
  [[nodiscard]] LateCause end(std::int64_t tick_ns, std::int64_t work_ns = -1) noexcept;

 private:
  std::int64_t period_ns_;
  bool report_clocked_;
  std::int64_t due_ns_ = 0, begin_ns_ = 0, end_ns_ = 0;  ///< end_ns_: of the tick before
  std::int64_t owed_work_ns_ = 0;                        ///< of the ticks before, at end_ns_
  LateCause owed_cause_ = LateCause::kWakeUp;            ///< of the delay
  std::int64_t state_ns_ = 0;                            ///< stamp of the newest state
  std::uint64_t sequence_ = 0;
  bool report_late_ = false, ended_ = false;
};

}  // namespace haptic::hal
