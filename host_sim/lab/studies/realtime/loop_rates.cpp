// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/realtime/loop_rates.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <functional>
#include <thread>

#include "hal/clock/servo_clock.hpp"
#include "host_sim/device/device_stack.hpp"
#include "host_sim/device/pressing_script.hpp"
#include "host_sim/device/stack_run.hpp"
#include "host_sim/report/quantile.hpp"

namespace haptic::sim {
namespace {

constexpr double kShare = 0.999, kDeviations = 3, kTicksOver = 3;
/// Until the threads have settled and the operator has armed.
constexpr double kSettle_s = 0.5;
/// Of an injected fault, in periods; and reports lost at once.
constexpr int kFaultPeriods = 3;
constexpr unsigned kLostReports = 4;

/// A scene as it is measured in real time: the reference device in a firm hand, which presses the
/// part on the nearest fixed one at any rate.
struct PressedScene {
  StackSettings stack;
  std::function<HandAction(double t_s)> hand;
  double rest_s = 0;  ///< the hand rests in contact then
};

/// The hand's motion lasts `seconds`, then it rests off the wall; deadman as in scripted_hand.
/// @throws tools::InputError  the scene's device table is out of range.
PressedScene pressed_scene(CoreSession& session, double rate_hz, double seconds) {
  // Of the pressing script: between its second and third station the hand rests.
  constexpr double kRestShare = 0.5;
  PressedScene scene;
  const SceneParameters& parameters = session.view().parameters();
  scene.stack = stack_over(StackCarrier::kUsb, device_of(parameters, rate_hz), parameters.device,
                           *hand_named("firm"), rate_hz);
  scene.hand =
      scripted_hand(session, make_motion(pressing_script(session, rate_hz, seconds)), rate_hz);
  scene.rest_s = kRestShare * seconds;
  return scene;
}

void spin_until(std::int64_t end_ns) {
  while (hal::monotonic_ns() < end_ns) {
  }
}

/// What the handler does on the servo thread: the machine that has no time for it.
constinit std::atomic<std::int64_t> hold_up_ns{0};
void hold_up(int) { spin_until(hal::monotonic_ns() + hold_up_ns.load(std::memory_order_relaxed)); }

/// For as long as it lives, SIGUSR1 holds up the thread that gets it.
class HoldUpSignal {
 public:
  explicit HoldUpSignal(std::int64_t for_ns) {
    hold_up_ns.store(for_ns);
    struct sigaction action {};
    action.sa_handler = hold_up;
    sigaction(SIGUSR1, &action, &before_);
  }
  ~HoldUpSignal() { sigaction(SIGUSR1, &before_, nullptr); }
  HoldUpSignal(const HoldUpSignal&) = delete;
  HoldUpSignal& operator=(const HoldUpSignal&) = delete;

 private:
  struct sigaction before_ {};
};

/// What the loop did, tick by tick, for the judgement afterwards.
struct TickRecords {
  std::vector<ServoInput> inputs;
  std::vector<DeviceCommand> commands;
  std::vector<std::int64_t> late_ns, tick_ns;
  std::size_t count = 0;

  explicit TickRecords(std::size_t most)
      : inputs(most), commands(most), late_ns(most), tick_ns(most) {}
};

/// Ticks that get more work, so many apart.
struct ExtraWork {
  std::uint64_t first = 0, every = 0, last = 0;
  std::int64_t for_ns = 0;

  static void add(void* self, std::uint64_t tick) {
    const auto& work = *static_cast<const ExtraWork*>(self);
    if (tick < work.first || tick > work.last || (tick - work.first) % work.every != 0) return;
    spin_until(hal::monotonic_ns() + work.for_ns);
  }
};

/// On the servo thread; the sends on the link's.
class RateWatch final : public hal::LinkObserver {
 public:
  RateWatch(hal::ServoLoop& loop, std::uint32_t lost_periods, std::uint64_t skip, std::size_t most,
            RateResult& result)
      : loop_(loop),
        lost_periods_(lost_periods),
        skip_(skip),
        records_(most),
        stamps_(kStamps),
        result_(result) {}

  static void watch(void* self, const ServoInput& input, const ServoResult& servo) {
    static_cast<RateWatch*>(self)->take(input, servo);
  }

  /// Causes of the ticks, once the loop has ended.
  void judge(ThreadedLoop& loop, std::int64_t period_ns) {
    const hal::ServoLoopCounters& counters = loop_.counters();
    if (records_.count > 0 && records_.count == counters.ticks)
      records_.tick_ns[records_.count - 1] = counters.last_tick_ns;
    const std::size_t count = records_.count;
    const std::vector<std::int64_t> work_ns =
        loop.work_of(std::span(records_.inputs).first(count),
                     std::span(records_.commands).first(count), kWorkRepeats);
    const double cold = std::max(kLeastCold, usual_cold(work_ns));
    hal::LateJudge judge(period_ns, false);
    for (std::size_t k = 0; k < count; ++k) {
      judge.begin(records_.inputs[k], records_.late_ns[k]);
      const double cold_ns = work_ns[k] < 0 ? -1 : cold * static_cast<double>(work_ns[k]);
      const hal::LateCause cause =
          judge.end(records_.tick_ns[k], static_cast<std::int64_t>(cold_ns));
      if (k < skip_) continue;
      result_.judged += 1;
      result_.causes[static_cast<std::size_t>(cause)] += 1;
      result_.unmatched += work_ns[k] < 0 ? 1u : 0u;
      if (work_ns[k] >= 0) result_.work.add(work_ns[k]);
    }
  }

 private:
  double usual_cold(const std::vector<std::int64_t>& work_ns) {
    std::vector<double> ratios;
    for (std::size_t k = skip_; k < work_ns.size(); ++k) {
      if (work_ns[k] > 0)
        ratios.push_back(static_cast<double>(records_.tick_ns[k]) /
                         static_cast<double>(work_ns[k]));
    }
    if (ratios.empty()) return 0;
    std::ranges::sort(ratios);
    return result_.cold = quantile(ratios, 0.5);
  }

  static constexpr std::size_t kStamps = 1u << 14;  // more than are under way at once

  void take(const ServoInput& input, const ServoResult& servo) noexcept {
    const hal::ServoLoopCounters& counters = loop_.counters();
    note(input, servo, counters);
    const bool is_new = input.state.sequence != newest_;
    newest_ = input.state.sequence;
    stamps_[servo.command.tick % kStamps].store(is_new ? input.state.stamp_ns : 0,
                                                std::memory_order_release);
    stamps_[(servo.command.tick + kStamps / 2) % kStamps].store(0, std::memory_order_relaxed);
    if (counters.ticks <= skip_) return;
    settled_.store(true, std::memory_order_relaxed);
    result_.ticks += 1;
    result_.lateness.add(counters.last_lateness_ns);
    result_.tick.add(counters.last_tick_ns);  // of the tick before
    const std::uint32_t late = input.late_periods;
    (late == 0 ? result_.in_time : late <= lost_periods_ ? result_.held : result_.beyond) += 1;
    result_.contact_ticks += servo.rendered.situation != ContactSituation::kNone ? 1u : 0u;
    result_.safety_faults |= servo.faults;
  }

  void note(const ServoInput& input, const ServoResult& servo,
            const hal::ServoLoopCounters& counters) noexcept {
    const std::size_t k = records_.count;
    if (k != counters.ticks - 1) return;  // the room is used up
    if (k > 0) records_.tick_ns[k - 1] = counters.last_tick_ns;
    if (k == records_.inputs.size()) return;
    records_.inputs[k] = input;
    records_.commands[k] = servo.command;
    records_.late_ns[k] = counters.last_lateness_ns;
    records_.count = k + 1;
  }

  // The stamp of a send is from before the bus has taken it; a look at the clock now is not. Its
  // tick may not have been watched yet, so it is looked up at the next send.
  void on_send(std::int64_t /*stamp_ns*/, std::span<const std::uint8_t> /*report*/,
               const hal::GuardedOutput& output) noexcept override {
    if (output.tick <= sent_) return;
    if (settled_.load(std::memory_order_relaxed) && looked_up_ < sent_) add_answer();
    looked_up_ = sent_;
    sent_ = output.tick;
    sent_ns_ = hal::monotonic_ns();
  }
  // The first command that rests on a report may be of an older tick than the one that was sent.
  void add_answer() noexcept {
    std::uint64_t k = looked_up_ + 1;
    if (sent_ - looked_up_ > kStamps / 2) k = sent_ - kStamps / 2;
    for (; k <= sent_; ++k) {
      const std::int64_t stamp_ns = stamps_[k % kStamps].load(std::memory_order_acquire);
      if (stamp_ns == 0) continue;
      result_.answer.add(sent_ns_ - stamp_ns);
      return;
    }
  }
  void on_report(std::int64_t /*stamp_ns*/, std::span<const std::uint8_t> /*report*/,
                 hal::ReportVerdict /*verdict*/, std::uint64_t /*sequence*/) noexcept override {}
  void on_link(std::int64_t /*stamp_ns*/, LinkState /*state*/,
               hal::HalStatus /*why*/) noexcept override {}

  hal::ServoLoop& loop_;
  std::uint32_t lost_periods_;
  std::uint64_t skip_, newest_ = 0;
  TickRecords records_;
  std::vector<std::atomic<std::int64_t>> stamps_;  ///< by tick: of its new state; 0: it had none
  std::atomic<bool> settled_{false};
  // Of the link's thread: tick of the newest command sent and of the one before, when it was sent.
  std::uint64_t sent_ = 0, looked_up_ = 0;
  std::int64_t sent_ns_ = 0;
  RateResult& result_;
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

void nap(double time_s) { std::this_thread::sleep_for(std::chrono::duration<double>(time_s)); }

/// Waits for the seconds and makes things go wrong meanwhile.
void wait_with_faults(ThreadedLoop& loop, const RateQuestion& question) {
  if (question.fault != RateFault::kWakeUp && question.fault != RateFault::kReport)
    return nap(question.seconds);
  const double step_s = question.seconds / (kInjectedFaults + 1);
  for (unsigned k = 0; k < kInjectedFaults; ++k) {
    nap(step_s);
    if (question.fault == RateFault::kWakeUp) {
      loop.interrupt_servo(SIGUSR1);
    } else {
      DeviceFaultEvent lost;
      lost.kind = DeviceFaultKind::kLost;
      lost.count = kLostReports;
      loop.bus().add(lost);
    }
  }
  nap(step_s);
}

}  // namespace

const char* to_text(ReportPath path) { return path == ReportPath::kUsb ? "usb" : "in_process"; }

std::unique_ptr<hal::WakeupMeasurement> machine_alone(double rate_hz, double seconds) {
  auto machine = std::make_unique<hal::WakeupMeasurement>();
  hal::WakeupQuestion alone;
  alone.period_ns = std::llround(1e9 / rate_hz);
  alone.duration_ns = std::llround(1e9 * seconds);
  alone.priority = ThreadedLoopSettings{}.servo_priority;
  hal::measure_wakeups(alone, *machine);
  return machine;
}

std::unique_ptr<RateResult> measure_rate(CoreSession& session, double rate_hz, ReportPath path,
                                         const RateQuestion& question,
                                         const hal::WakeupMeasurement& machine) {
  auto result = std::make_unique<RateResult>();
  result->rate_hz = rate_hz;
  result->path = path;
  result->machine = machine;
  const double reports_hz =
      path == ReportPath::kUsb ? std::min(rate_hz, kMostUsbReports_hz) : rate_hz;
  result->asked_reports_hz = reports_hz;
  const double seconds = question.seconds;
  const std::int64_t period_ns = std::llround(1e9 / rate_hz);

  const PressedScene pressed = pressed_scene(session, reports_hz, seconds + 2 * kSettle_s);
  ThreadedLoopSettings settings;
  settings.stack = pressed.stack;
  settings.stack.limits.period_ns = period_ns;
  settings.without_bus = path == ReportPath::kInProcess;
  ThreadedLoop loop(session, settings, pressed.hand);
  const auto skip = static_cast<std::uint64_t>(kSettle_s * rate_hz);
  const double expected = (seconds + 2 * kSettle_s) * rate_hz;
  const std::size_t most = std::min(kJudgedTicks, static_cast<std::size_t>(expected));
  RateWatch watch(loop.loop(), usable(settings.stack.limits).lost_periods, skip, most, *result);
  loop.watch(&RateWatch::watch, &watch);
  loop.observe(&watch);
  ExtraWork extra;
  if (question.fault == RateFault::kTick) {
    extra.for_ns = kFaultPeriods * period_ns;
    extra.every = static_cast<std::uint64_t>(seconds * rate_hz / (kInjectedFaults + 1));
    extra.first = skip + extra.every;
    extra.last = extra.first + (kInjectedFaults - 1) * extra.every;
    loop.add_work(&ExtraWork::add, &extra);
  }
  const HoldUpSignal signal(kFaultPeriods * period_ns);
  loop.start(hal::monotonic_ns(), true);
  nap(kSettle_s);
  const std::uint64_t reports = loop.link().counters().reports;
  const std::int64_t begin_ns = hal::monotonic_ns();
  wait_with_faults(loop, question);
  const double elapsed_s = 1e-9 * static_cast<double>(hal::monotonic_ns() - begin_ns);
  result->reports_per_s = static_cast<double>(loop.link().counters().reports - reports) / elapsed_s;
  loop.stop();
  result->without_state = loop.loop().counters().without_state;
  result->grants = loop.grants();
  watch.judge(loop, period_ns);
  judge(*result);
  return result;
}

double highest_rate(const std::vector<std::unique_ptr<RateResult>>& results) {
  double highest = 0;
  for (const auto& result : results) {
    if (result->path != ReportPath::kUsb) continue;
    if (!result->holds()) break;
    highest = result->rate_hz;
  }
  return highest;
}

}  // namespace haptic::sim
