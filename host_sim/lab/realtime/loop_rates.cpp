// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/realtime/loop_rates.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "hal/clock/servo_clock.hpp"
#include "host_sim/lab/realtime/pressed_scene.hpp"

namespace haptic::sim {
namespace {

constexpr double kShare = 0.999, kDeviations = 3, kTicksOver = 3;
/// Until the threads have settled and the operator has armed.
constexpr double kSettle_s = 0.5;

/// On the servo thread.
struct TickCount {
  hal::ServoLoop* loop;
  std::uint32_t lost_periods;
  std::uint64_t skip;
  RateResult* result;

  static void watch(void* self, const ServoInput& input, const ServoResult& servo) {
    static_cast<TickCount*>(self)->take(input, servo);
  }
  void take(const ServoInput& input, const ServoResult& servo) noexcept {
    const hal::ServoLoopCounters& counters = loop->counters();
    if (counters.ticks <= skip) return;
    result->ticks += 1;
    result->lateness.add(counters.last_lateness_ns);
    result->tick.add(counters.last_tick_ns);  // of the tick before
    const std::uint32_t late = input.late_periods;
    (late == 0 ? result->in_time : late <= lost_periods ? result->held : result->beyond) += 1;
    result->contact_ticks += servo.rendered.situation != ContactSituation::kNone ? 1u : 0u;
    result->safety_faults |= servo.faults;
  }
};

void judge(RateResult& r) {
  const double period_ns = 1e9 / r.rate_hz;
  const double room_ns = period_ns - static_cast<double>(r.machine.lateness.quantile_ns(kShare));
  r.ticks_fit = r.ticks > 0 && static_cast<double>(r.tick.quantile_ns(kShare)) < room_ns;
  const double alone = static_cast<double>(r.machine.lateness.count());
  const double share = alone > 0 ? static_cast<double>(r.machine.late_ticks) / alone : 0;
  const double expected = share * static_cast<double>(r.ticks);
  r.late_allowed = expected + kDeviations * std::sqrt(expected) + kTicksOver;
  r.late_as_machine = static_cast<double>(r.held + r.beyond) <= r.late_allowed;
}

}  // namespace

std::unique_ptr<RateResult> measure_rate(const std::string& scene, double rate_hz, double seconds) {
  auto result = std::make_unique<RateResult>();
  result->rate_hz = rate_hz;
  ThreadedLoopSettings settings;
  hal::WakeupQuestion alone;
  alone.period_ns = std::llround(1e9 / rate_hz);
  alone.duration_ns = std::llround(1e9 * seconds);
  alone.priority = settings.servo_priority;
  hal::measure_wakeups(alone, result->machine);

  CoreSession session(scene);
  const PressedScene pressed = pressed_scene(session, rate_hz, seconds + 2 * kSettle_s);
  settings.stack = pressed.stack;
  ThreadedLoop loop(session, settings, pressed.hand);
  TickCount count{&loop.loop(), usable(settings.stack.limits).lost_periods,
                  static_cast<std::uint64_t>(kSettle_s * rate_hz), result.get()};
  loop.watch(&TickCount::watch, &count);
  loop.start(hal::monotonic_ns(), true);
  const auto nap = [](double time_s) {
    std::this_thread::sleep_for(std::chrono::duration<double>(time_s));
  };
  nap(kSettle_s);
  const std::uint64_t reports = loop.link().counters().reports;
  const std::int64_t begin_ns = hal::monotonic_ns();
  nap(seconds);
  const double elapsed_s = 1e-9 * static_cast<double>(hal::monotonic_ns() - begin_ns);
  result->reports_per_s = static_cast<double>(loop.link().counters().reports - reports) / elapsed_s;
  loop.stop();
  result->without_state = loop.loop().counters().without_state;
  result->grants = loop.grants();
  judge(*result);
  return result;
}

double highest_rate(const std::vector<std::unique_ptr<RateResult>>& results) {
  double highest = 0;
  for (const auto& result : results) {
    if (!result->holds()) break;
    highest = result->rate_hz;
  }
  return highest;
}

}  // namespace haptic::sim
