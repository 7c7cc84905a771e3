// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which rates of the servo loop hold on this machine: the stack in its threads, timer-clocked, at
/// each rate, compared with the machine's own wake-ups at that rate with nothing to do.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hal/realtime/wakeup_measurement.hpp"
#include "host_sim/lab/realtime/threaded_loop.hpp"

namespace haptic::sim {

struct RateQuestion {
  std::vector<double> rates_hz = {1000, 2000, 4000, 8000};
  double seconds = 5;  ///< of the loop, and as long of the machine alone
};

/// A rate holds when both are so:
/// 1. 999 of a thousand ticks leave room for the machine: the time of the tick that 99.9 % keep,
///    with the lateness of the machine's own wake-ups that 99.9 % keep, is below the period.
/// 2. Ticks of ours that begin a whole period late or more are not more than the machine's own
///    wake-ups: not above their share of the ticks by more than three standard deviations of such a
///    count and three ticks.
struct RateResult {
  double rate_hz = 0;
  std::uint64_t ticks = 0, in_time = 0;
  std::uint64_t held = 0;    ///< late by 1 period to SafetyLimits::lost_periods: the force is held
  std::uint64_t beyond = 0;  ///< later: ramp to zero
  std::uint64_t contact_ticks = 0, without_state = 0;
  std::uint32_t safety_faults = 0;  ///< latched, ever
  double reports_per_s = 0;         ///< that the simulated device on the bus gave
  hal::WakeupHistogram lateness, tick;
  hal::WakeupMeasurement machine;  ///< alone, just before
  LoopGrants grants;
  double late_allowed = 0;  ///< of point 2
  bool ticks_fit = false, late_as_machine = false;
  [[nodiscard]] bool holds() const { return ticks_fit && late_as_machine; }
};

/// Blocks for twice the seconds. @throws std::runtime_error  no thread; tools::InputError  the
/// scene.
[[nodiscard]] std::unique_ptr<RateResult> measure_rate(const std::string& scene, double rate_hz,
                                                       double seconds);

/// Highest rate that holds with all below it; 0: none.
[[nodiscard]] double highest_rate(const std::vector<std::unique_ptr<RateResult>>& results);

}  // namespace haptic::sim
