// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/late_causes.hpp"

#include <algorithm>

namespace haptic::hal {

const char* to_text(LateCause cause) noexcept {
  static constexpr std::array<const char*, kLateCauses> kTexts = {"in_time", "wake_up", "tick",
                                                                  "report",  "held_up", "together"};
  const auto k = static_cast<std::size_t>(cause);
  return k < kLateCauses ? kTexts[k] : "unknown";
}

void LateJudge::begin(const ServoInput& input, std::int64_t late_ns) noexcept {
  const DeviceState& state = input.state;
  const bool had = sequence_ != 0, is_new = state.sequence != sequence_;
  const std::int64_t last_ns = state_ns_;
  sequence_ = state.sequence;
  state_ns_ = state.stamp_ns;
  begin_ns_ = input.now_ns;
  const std::int64_t report_ns = std::max(state.limits.report_period_ns, period_ns_);
  if (report_clocked_) {
    due_ns_ = is_new ? std::min(state.stamp_ns, begin_ns_) : begin_ns_;
    report_late_ = had && (!is_new || state.stamp_ns - last_ns >= report_ns + report_ns / 2);
  } else {
    due_ns_ = begin_ns_ - std::max<std::int64_t>(late_ns, 0);
    report_late_ = state.sequence != 0 && begin_ns_ - state.stamp_ns >= 2 * report_ns;
  }
}

LateCause LateJudge::end(std::int64_t tick_ns, std::int64_t work_ns) noexcept {
  const std::int64_t known_ns = work_ns < 0 ? tick_ns : std::min(work_ns, tick_ns);
  // It could begin when it was due, or when the tick before was over.
  const std::int64_t owed_ns =
      ended_ ? std::clamp<std::int64_t>(end_ns_ - due_ns_, 0, begin_ns_ - due_ns_) : 0;
  const std::int64_t owed_work_ns = std::min(owed_ns, owed_work_ns_);
  const std::int64_t owed_delay_ns = owed_ns - owed_work_ns;
  const std::int64_t woken_ns = begin_ns_ - due_ns_ - owed_ns, held_ns = tick_ns - known_ns;
  const std::int64_t total_ns = begin_ns_ - due_ns_ + tick_ns;
  std::int64_t delay_ns[2] = {woken_ns, held_ns};
  delay_ns[owed_cause_ == LateCause::kHeldUp ? 1 : 0] += owed_delay_ns;

  const std::int64_t work_all_ns = owed_work_ns + known_ns;
  const LateCause delayed = delay_ns[1] > delay_ns[0] ? LateCause::kHeldUp : LateCause::kWakeUp;
  // What the next tick may have to wait for.
  ended_ = true;
  end_ns_ = begin_ns_ + tick_ns;
  owed_work_ns_ = std::max<std::int64_t>(work_all_ns - period_ns_, 0);
  owed_cause_ = delayed;
  if (total_ns <= period_ns_) return report_late_ ? LateCause::kReport : LateCause::kInTime;
  if (work_all_ns > period_ns_) return LateCause::kTick;
  return delay_ns[0] + delay_ns[1] >= work_all_ns ? delayed : LateCause::kTogether;
}

}  // namespace haptic::hal
