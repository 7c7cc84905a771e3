// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which rates of the servo loop hold on this machine: the stack in its threads, timer-clocked, at
/// each rate, compared with the machine's own wake-ups at that rate with nothing to do; how long
/// things take, and why ticks were late.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hal/realtime/late_causes.hpp"
#include "hal/realtime/wakeup_measurement.hpp"
#include "host_sim/lab/realtime/threaded_loop.hpp"

namespace haptic::sim {

/// The device's reports on their way to the loop.
enum class ReportPath : std::uint8_t {
  kUsb = 0,    ///< libusb on the bus inside this process
  kInProcess,  ///< handed over by the thread of the link
};
[[nodiscard]] const char* to_text(ReportPath path);

/// Reports per second that an interrupt endpoint of a high-speed device carries: one a microframe.
inline constexpr double kMostUsbReports_hz = 8000;

/// What is made to go wrong ten times in a run: each must be found, and under its own cause.
enum class RateFault : std::uint8_t {
  kNone = 0,
  kWakeUp,  ///< the servo thread is held up in its sleep for three periods
  kTick,    ///< a tick has work for three periods more
  kReport,  ///< four reports in a row are lost (ReportPath::kUsb)
};
inline constexpr unsigned kInjectedFaults = 10;

struct RateQuestion {
  std::vector<double> rates_hz = {1000, 2000, 4000, 8000, 10000};
  double seconds = 5;  ///< of the loop on each path, and as long of the machine alone
  RateFault fault = RateFault::kNone;
};

/// A rate holds when both are so:
/// 1. 999 of a thousand ticks leave room for the machine: the time of the tick that 99.9 % keep,
///    with the lateness of the machine's own wake-ups that 99.9 % keep, is below the period.
/// 2. Ticks of ours that begin a whole period late or more are not more than the machine's own
///    wake-ups: not above their share of the ticks by more than three standard deviations of such a
///    count and three ticks.
struct RateResult {
  double rate_hz = 0;
  ReportPath path = ReportPath::kUsb;
  double asked_reports_hz = 0;  ///< of the device: the rate, and on USB kMostUsbReports_hz at most
  std::uint64_t ticks = 0, in_time = 0;
  std::uint64_t held = 0;    ///< late by 1 period to SafetyLimits::lost_periods: the force is held
  std::uint64_t beyond = 0;  ///< later: ramp to zero
  std::uint64_t contact_ticks = 0, without_state = 0;
  std::uint32_t safety_faults = 0;  ///< latched, ever
  double reports_per_s = 0;         ///< that the simulated device gave
  hal::WakeupHistogram lateness, tick;
  /// From the completion of a report to the first command that rests on it handed to the device.
  hal::WakeupHistogram answer;
  /// By cause, with the work of a tick by itself (kLeastCold); of the first kJudgedTicks.
  hal::CauseCounts causes{};
  std::uint64_t judged = 0;     ///< ticks in `causes`
  std::uint64_t unmatched = 0;  ///< of them, those whose work was another one when it was repeated
  hal::WakeupHistogram work;    ///< of the judged ticks by themselves, warm
  double cold = 0;              ///< median of a tick's time over its work by itself
  hal::WakeupMeasurement machine;  ///< alone, just before
  LoopGrants grants;
  double late_allowed = 0;  ///< of point 2
  bool ticks_fit = false, late_as_machine = false;
  [[nodiscard]] bool holds() const { return ticks_fit && late_as_machine; }
  [[nodiscard]] std::uint64_t late_by(hal::LateCause cause) const {
    return causes[static_cast<std::size_t>(cause)];
  }
};

/// Work of a tick as its cause takes it: the least of kWorkRepeats repeats with nothing in between,
/// times `cold`, which is how much longer a tick of this run usually takes than that: after a sleep
/// the caches are cold. At least kLeastCold, as with all caches flushed. What a tick takes beyond
/// is the machine's.
inline constexpr double kLeastCold = 1.5;
inline constexpr unsigned kWorkRepeats = 3;
/// Ticks of which inputs are kept for that: 150 MB.
inline constexpr std::size_t kJudgedTicks = 1u << 18;

/// The machine's own wake-ups at a rate. Blocks for the seconds.
[[nodiscard]] std::unique_ptr<hal::WakeupMeasurement> machine_alone(double rate_hz, double seconds);

/// Blocks for the seconds and those of the repeats. The core starts again. @throws
/// std::runtime_error  no thread;
/// tools::InputError  the scene.
[[nodiscard]] std::unique_ptr<RateResult> measure_rate(CoreSession& session, double rate_hz,
                                                       ReportPath path,
                                                       const RateQuestion& question,
                                                       const hal::WakeupMeasurement& machine);

/// Highest rate on USB that holds with all below it; 0: none.
[[nodiscard]] double highest_rate(const std::vector<std::unique_ptr<RateResult>>& results);

}  // namespace haptic::sim
