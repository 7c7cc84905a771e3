// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/realtime/motion_delay.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_codec.hpp"
#include "host_sim/lab/realtime/pressed_scene.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

// Long enough to arm, press and rest; then a step that any contact answers, and time to see it act.
constexpr double kVirtualSeconds = 2.0, kStep_m = 2.0e-3;
constexpr std::size_t kMostAnswer = 40;  ///< periods
constexpr std::size_t kRoomPerReport = 4;

std::uint64_t number_of(double periods) {
  return static_cast<std::uint64_t>(std::llround(periods));
}

bool differs(const Load& a, const Load& b) {
  return a.force_w != b.force_w || a.torque_w != b.torque_w;
}

struct AnsweringTick {
  StackTick tick;
  std::vector<std::uint8_t> report;
};

/// The stack up to the step of the hand, and what followed.
std::vector<AnsweringTick> ticks_about_step(const std::string& scene, const DelayQuestion& question,
                                            bool report_clocked, double phase, bool with_step) {
  CoreSession session(scene);
  PressedScene pressed = pressed_scene(session, question.rate_hz, kVirtualSeconds);
  pressed.stack.report_clocked = report_clocked;
  pressed.stack.servo_phase = phase;
  Vector step_d = Vector::Zero();
  DeviceStack stack(session, pressed.stack, [&pressed, &step_d](double t_s) {
    HandAction action = pressed.hand(t_s);
    action.target.x0_w += step_d;
    return action;
  });
  const std::uint64_t before = number_of(pressed.rest_s * question.rate_hz);
  StackTick last;
  for (std::uint64_t k = 0; k < before; ++k) last = stack.step();
  if (!(last.acting.force_w.norm() > 0))
    throw tools::InputError(scene + ": the hand that presses feels no force; another start pose");
  if (with_step) step_d = -kStep_m * last.acting.force_w.normalized();  // against it, so deeper
  std::vector<AnsweringTick> after;
  for (std::size_t k = 0; k < kMostAnswer; ++k) {
    AnsweringTick& tick = after.emplace_back();
    tick.tick = stack.step();
    tick.report =
        stack.bus().with_model([](const ReferenceModel& model) { return model.report(); });
  }
  stack.unplug();
  static_cast<void>(stack.step());
  return after;
}

bool sent_differs(const StackTick& a, const StackTick& b) {
  if (a.sent.size() != b.sent.size()) return true;
  for (std::size_t k = 0; k < a.sent.size(); ++k) {
    if (differs(a.sent[k].wrench, b.sent[k].wrench)) return true;
  }
  return false;
}

VirtualDelay delay_at_phase(const std::string& scene, const DelayQuestion& question,
                            bool report_clocked, double phase) {
  const auto moved = ticks_about_step(scene, question, report_clocked, phase, true);
  const auto still = ticks_about_step(scene, question, report_clocked, phase, false);
  const double period_ns = 1e9 / question.rate_hz;
  double sampled = -1, tick = -1, handed = -1, acts = -1;  ///< in periods
  for (std::size_t k = 0; k < moved.size(); ++k) {
    const double at = static_cast<double>(k);
    const StackTick &a = moved[k].tick, &b = still[k].tick;
    if (sampled < 0 && moved[k].report != still[k].report) sampled = at;
    if (tick < 0 && a.servo.rendered.goal_pose_wa.p_wa != b.servo.rendered.goal_pose_wa.p_wa)
      tick = at + (report_clocked ? 0 : phase);
    if (handed < 0 && sent_differs(a, b)) handed = at;
    // What acts in a period does so from its begin on, which is one period before its sample.
    if (acts < 0 && differs(a.acting, b.acting)) acts = at - 1;
  }
  if (sampled < 0 || tick < 0 || handed < 0 || acts < 0)
    throw tools::InputError(scene + ": a step of the hand in contact changes no force");
  VirtualDelay delay;
  delay.phase = phase;
  const auto ns = [period_ns](double periods) { return std::llround(periods * period_ns); };
  delay.at_ns = {0, ns(tick - sampled), ns(tick - sampled), ns(handed - sampled),
                 ns(acts - sampled)};
  return delay;
}

/// Stamps of all threads, each written by one and read when all have ended.
class DelayWatch final : public hal::LinkObserver {
 public:
  explicit DelayWatch(std::size_t reports)
      : sampled_(reports),
        reports_(reports),
        ticks_(kRoomPerReport * reports),
        sends_(kRoomPerReport * reports) {}

  /// On the device's thread, when the period's sample is taken.
  void sampled(std::uint64_t period) noexcept {
    if (period < sampled_.size()) sampled_[period] = hal::monotonic_ns();
  }
  void on_report(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
                 hal::ReportVerdict verdict, std::uint64_t sequence) noexcept override {
    hal::ReferenceReport decoded;
    if (verdict != hal::ReportVerdict::kState || sequence >= reports_.size()) return;
    if (hal::decode(report, decoded) != hal::CodecVerdict::kOk) return;
    reports_[sequence] = {decoded.sequence, stamp_ns};
    newest_ = sequence;
  }
  void on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> /*report*/,
               const hal::GuardedOutput& output) noexcept override {
    if (send_count_ < sends_.size())
      sends_[send_count_++] = {output.tick, stamp_ns, hal::monotonic_ns()};
  }
  void on_link(std::int64_t, LinkState, hal::HalStatus) noexcept override {}
  static void saw(void* self, const ServoInput& input, const ServoResult& result) {
    static_cast<DelayWatch*>(self)->note(input, result);
  }
  [[nodiscard]] MeasuredDelays delays() const;

 private:
  struct Report {
    std::uint64_t period = 0;
    std::int64_t stamp_ns = 0;
  };
  struct Tick {
    std::uint64_t number = 0, sequence = 0;
    std::int64_t begin_ns = 0, end_ns = 0;
  };
  struct Send {
    std::uint64_t tick = 0;
    std::int64_t handed_ns = 0, acts_ns = 0;
  };
  void note(const ServoInput& input, const ServoResult& result) noexcept {
    contact_ += result.rendered.situation != ContactSituation::kNone ? 1u : 0u;
    if (tick_count_ < ticks_.size())
      ticks_[tick_count_++] = {result.command.tick, input.state.sequence, input.now_ns,
                               hal::monotonic_ns()};
  }

  std::vector<std::int64_t> sampled_;
  std::vector<Report> reports_;
  std::vector<Tick> ticks_;
  std::vector<Send> sends_;
  std::size_t tick_count_ = 0, send_count_ = 0;
  std::uint64_t newest_ = 0, contact_ = 0;
};

MeasuredDelays DelayWatch::delays() const {
  MeasuredDelays result;
  result.contact_ticks = contact_;
  std::size_t tick = 0, send = 0;
  for (std::uint64_t s = 1; s <= newest_; ++s) {
    const Report& report = reports_[s];
    if (report.stamp_ns == 0 || report.period >= sampled_.size()) continue;
    result.reports += 1;
    while (tick < tick_count_ && ticks_[tick].sequence < s) ++tick;
    if (tick == tick_count_) break;
    while (send < send_count_ && (sends_[send].tick < ticks_[tick].number ||
                                  sends_[send].acts_ns < ticks_[tick].begin_ns))
      ++send;
    if (send == send_count_) break;
    const std::int64_t from_ns = sampled_[report.period];
    if (from_ns == 0) continue;
    result.at_ns.push_back({report.stamp_ns - from_ns, ticks_[tick].begin_ns - from_ns,
                            ticks_[tick].end_ns - from_ns, sends_[send].handed_ns - from_ns,
                            sends_[send].acts_ns - from_ns});
  }
  return result;
}

}  // namespace

const char* to_text(DelayStage stage) {
  static constexpr std::array<const char*, kDelayStages> kTexts = {
      "report complete", "tick begins", "command published", "handed to the bus", "acts"};
  return kTexts[static_cast<std::size_t>(stage)];
}

std::vector<VirtualDelay> virtual_delays(const std::string& scene, const DelayQuestion& question,
                                         bool report_clocked) {
  std::vector<VirtualDelay> delays;
  const unsigned phases = report_clocked ? 1 : question.phases;
  for (unsigned k = 0; k < phases; ++k)
    delays.push_back(delay_at_phase(scene, question, report_clocked, (k + 0.5) / phases));
  return delays;
}

MeasuredDelays measured_delays(const std::string& scene, const DelayQuestion& question,
                               bool report_clocked) {
  CoreSession session(scene);
  const PressedScene pressed = pressed_scene(session, question.rate_hz, question.seconds);
  ThreadedLoopSettings settings;
  settings.stack = pressed.stack;
  settings.stack.report_clocked = report_clocked;
  DelayWatch watch(number_of((question.seconds + 1) * question.rate_hz));
  const double rate_hz = question.rate_hz;
  ThreadedLoop loop(session, settings, [&watch, &pressed, rate_hz](double t_s) {
    watch.sampled(number_of(t_s * rate_hz));
    return pressed.hand(t_s);
  });
  loop.watch(&DelayWatch::saw, &watch);
  loop.observe(&watch);
  loop.start(hal::monotonic_ns(), true);
  std::this_thread::sleep_for(std::chrono::duration<double>(question.seconds));
  loop.stop();
  MeasuredDelays delays = watch.delays();
  delays.grants = loop.grants();
  return delays;
}

}  // namespace haptic::sim
