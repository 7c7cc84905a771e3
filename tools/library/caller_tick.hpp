// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A servo tick that the caller makes in a loop of its own, by its own clock: from the structures
/// of the C interface to those of the core and back.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "rt_core/servo_tick.hpp"
#include "tools/library/call.hpp"
#include "tools/library/handle_call.hpp"

namespace haptic::tools {

/// Time of the ticks, made of the caller's, which may be anything: it goes forward by at least
/// nothing and at most kMostStep_ns a tick, and says whether the caller's time was one.
class CallersTime {
 public:
  explicit CallersTime(std::int64_t period_ns) noexcept : period_ns_(period_ns) {}

  /// One tick at `time_s`. @return whether it goes on from the last; else a period is taken for it.
  [[nodiscard]] bool advance(double time_s, std::uint32_t most_still_ticks) noexcept {
    const bool is_time = is_within(time_s, 0, kMostTime_s);
    const std::int64_t given_ns = is_time ? std::llround(1e9 * time_s) : 0;
    const bool is_first = !has_given_;
    const std::int64_t passed_ns = is_first ? 0 : given_ns - given_ns_;
    if (is_time) {
      given_ns_ = given_ns;
      has_given_ = true;
    }
    // A clock of coarse steps gives the same time twice; one that stands gives it for ever.
    still_ticks_ = is_time && passed_ns == 0 && !is_first ? still_ticks_ + 1 : 0;
    const bool goes_on = is_time && passed_ns >= 0 && still_ticks_ <= most_still_ticks;
    now_ns_ += goes_on ? std::min(passed_ns, kMostStep_ns) : period_ns_;
    return goes_on;
  }
  [[nodiscard]] std::int64_t now_ns() const noexcept { return now_ns_; }
  /// `time_s` of the same clock, as far as it is of the last seconds; one that is none is long ago.
  [[nodiscard]] std::int64_t stamp_ns(double time_s) const noexcept {
    if (!is_within(time_s, 0, kMostTime_s)) return now_ns_ - kLongAgo_ns;
    const std::int64_t age_ns = given_ns_ - std::llround(1e9 * time_s);
    return now_ns_ - std::clamp(age_ns, -kMostStep_ns, kLongAgo_ns);
  }

 private:
  // Beyond each of them everything is late all the same.
  static constexpr std::int64_t kMostStep_ns = 1'000'000'000, kLongAgo_ns = 1'000'000'000'000;
  std::int64_t period_ns_;
  std::int64_t now_ns_ = 1'000'000'000'000'000;  ///< so that what is long ago is still above 0
  std::int64_t given_ns_ = 0;
  std::uint32_t still_ticks_ = 0;
  bool has_given_ = false;
};

/// HAPTIC_OK; HAPTIC_ERROR_VERSION; HAPTIC_ERROR_NUMBER; HAPTIC_ERROR_POSE.
[[nodiscard]] int check_options(const haptic_servo_options* options) noexcept;

/// The options were checked.
[[nodiscard]] ServoParameters parameters_of(const haptic_servo_options& options,
                                            const SceneView& view) noexcept;

/// Input of a tick: a report by the caller's clock, at the time that `time` has just taken.
/// `goes_on`: what CallersTime::advance has said of it.
[[nodiscard]] ServoInput input_of(const CallersTime& time, bool goes_on, std::uint32_t lost_periods,
                                  const haptic_servo_input& given) noexcept;

/// `output` is of a size that is known.
void write_output(const ServoResult& result, haptic_servo_output& output) noexcept;

}  // namespace haptic::tools
