// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/realtime/threaded_stage.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_codec.hpp"
#include "host_sim/lab/faults/fault_run.hpp"
#include "host_sim/lab/faults/fault_script.hpp"

namespace haptic::sim {
namespace {

/// Where within a period, in tenths, the servo loop ticks. The period is looked at, and things go
/// wrong, at its end: as in the stack of one thread after the tick and before the next report.
constexpr std::int64_t kTickTenths = 5;
/// For a command that is under way between two threads.
constexpr std::int64_t kLook_ns = 20'000;
constexpr int kMostLooks = 50;
constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::max();
/// A stalled servo thread looks so often in a period whether it may go.
constexpr std::int64_t kStallLooks = 20;
/// Connecting for the first time.
constexpr int kMostConnectPeriods = 2000;

/// Raises `largest`; one thread writes, another takes.
void raise(std::atomic<std::int64_t>& largest, std::int64_t value) noexcept {
  std::int64_t seen = largest.load(std::memory_order_relaxed);
  while (value > seen && !largest.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
  }
}

}  // namespace

ThreadedLoopSettings ThreadedStage::settings_of(const StackSettings& stack) {
  ThreadedLoopSettings settings;
  settings.stack = stack;
  settings.link_clock = &ThreadedStage::link_clock;
  settings.link_slept = &ThreadedStage::link_slept;
  settings.tick_clock = &ThreadedStage::tick_clock;
  settings.clock_context = this;
  return settings;
}

ThreadedStage::ThreadedStage(std::span<const std::byte> scene, const StackSettings& stack,
                             std::uint64_t (*heap_calls)())
    : FaultStage(1.0 / stack.model.report_rate_hz, hand_at_start()),
      period_ns_(stack.limits.period_ns),
      heap_calls_(heap_calls),
      session_(scene, "soak"),
      loop_(session_, settings_of(stack), [this](double t_s) { return note_begin(t_s); }) {
  loop_.watch(&ThreadedStage::saw, this);
  loop_.observe(this);
  next_ns_ = hal::monotonic_ns() + period_ns_;
  loop_.start(next_ns_ + kTickTenths * period_ns_ / 10, false);
  priority_error_ = take_priority(ThreadedLoopSettings{}.device_priority);
  restart();
  for (int k = 0; k < kMostConnectPeriods && loop_.link().state() != LinkState::kReady; ++k)
    static_cast<void>(step());
  if (loop_.link().state() != LinkState::kReady)
    throw std::runtime_error("the device in this process is not found: " + loop_.link().trouble());
}

// Unplugged, closing does not wait for a ramp, for which the device's periods would have to pass.
ThreadedStage::~ThreadedStage() {
  give_priority_back();
  stalled_until_ns_.store(0);
  unplug();
  loop_.stop();
}

LoopGrants ThreadedStage::grants() const {
  LoopGrants grants = loop_.grants();
  grants.device_priority = priority_error_;
  return grants;
}

ThreadHeap ThreadedStage::heap() const { return {servo_calls_.load(), usb_calls_.load()}; }

void ThreadedStage::restart() {
  const std::int64_t behind = hal::monotonic_ns() - next_ns_;
  if (behind > 0) next_ns_ += (behind / period_ns_ + 1) * period_ns_;
  static_cast<void>(hal::sleep_until(next_ns_));
  tick_late_ns_.store(0);
  usb_late_ns_.store(0);
}

/// The hand is asked when a period begins, and nothing is accepted meanwhile; once while the model
/// is being made.
HandAction ThreadedStage::note_begin(double t_s) {
  if (t_s > 0) acts_ = loop_.model().accepted();
  return hand().action(t_s);
}

/// From just before a report until just before the next one: what the device has accepted by then
/// is what acts in the next period. One that the machine missed is left out: the device's own time
/// stood still.
FaultSample ThreadedStage::pass_period() {
  FaultSample sample;
  bus().step();
  sample.acts = acts_;
  bus().with_model([&sample](const ReferenceModel& model) { sample.acting = model.acting(); });
  next_ns_ += period_ns_;
  static_cast<void>(hal::sleep_until(next_ns_));
  sample.late_ns = hal::monotonic_ns() - next_ns_;
  next_ns_ += sample.late_ns / period_ns_ * period_ns_;
  bus().with_model([&sample](const ReferenceModel& model) {
    sample.accepted = model.accepted();
    sample.drives_on = model.drives_on();
    sample.watchdog_cuts = model.cuts();
  });
  sample.late_ns = std::max({sample.late_ns, tick_late_ns_.exchange(0), usb_late_ns_.exchange(0)});
  sample.arming = arming_.load();
  sample.safety = safety_.load();
  sample.device = told_.load() | told_since_.exchange(0);
  sample.link = loop_.link().state();
  take_sends(sample);
  return sample;
}

void ThreadedStage::take_sends(FaultSample& sample) {
  SentBytes sent;
  int looks = 0;
  for (;;) {
    if (!sent_.pop(sent)) {
      // The device has it before the USB thread, which may have been interrupted, tells of it.
      if (!hal::is_newer(sample.accepted, last_sent_) || ++looks > kMostLooks) return;
      static_cast<void>(hal::sleep_until(hal::monotonic_ns() + kLook_ns));
      continue;
    }
    hal::ReferenceCommand command;
    if (hal::decode(std::span<const std::uint8_t>(sent.bytes.data(), sent.size), command) !=
        hal::CodecVerdict::kOk)
      continue;
    StackSend& send = sample.sent.emplace_back();
    send.stamp_ns = sent.stamp_ns;
    send.sequence = last_sent_ = command.sequence;
    send.drives_on = command.drives_on;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      send.wrench.force_w[axis] = command.force[k] * hal::kReferenceForceUnit_n;
      send.wrench.torque_w[axis] = command.torque[k] * hal::kReferenceTorqueUnit_nm;
    }
  }
}

// Until just before the tick that follows the missed ones.
void ThreadedStage::stall_servo(unsigned periods) {
  stalled_until_ns_.store(next_ns_ + periods * period_ns_ + kTickTenths * period_ns_ / 10);
}

void ThreadedStage::lose_servo() {
  stalled_until_ns_.store(kNever_ns);
  loop_.link().servo_lost();
}

void ThreadedStage::restart_servo() {
  loop_.restart_servo([this] { stalled_until_ns_.store(0); });
  restart();
}

// Switched on, the device counts commands from 0 again.
void ThreadedStage::plug(bool power) {
  if (power) {
    bus().with_model([](ReferenceModel& model) { model.power_up(); });
    last_sent_ = 0;
  }
  loop_.usb_link().set_wrapped_fd(bus().plug());
}

/// The USB thread looks at the clock at every turn, and its turns wait half a period at most.
std::int64_t ThreadedStage::link_clock(void* self) {
  auto& stage = *static_cast<ThreadedStage*>(self);
  const std::int64_t now_ns = hal::monotonic_ns();
  if (stage.last_look_ns_ != 0)
    raise(stage.usb_late_ns_, now_ns - stage.last_look_ns_ - stage.period_ns_ / 2);
  stage.last_look_ns_ = now_ns;
  return now_ns;
}

std::int64_t ThreadedStage::link_slept(void* self) {
  return static_cast<const ThreadedStage*>(self)->slept_ns_.load();
}

/// Asked for just before a tick, which is where a servo thread that hangs hangs.
std::int64_t ThreadedStage::tick_clock(void* self) {
  auto& stage = *static_cast<ThreadedStage*>(self);
  std::int64_t now_ns = hal::monotonic_ns();
  while (now_ns < stage.stalled_until_ns_.load(std::memory_order_acquire)) {
    static_cast<void>(hal::sleep_until(now_ns + stage.period_ns_ / kStallLooks));
    now_ns = hal::monotonic_ns();
  }
  return now_ns;
}

void ThreadedStage::saw(void* self, const ServoInput& input, const ServoResult& result) {
  static_cast<ThreadedStage*>(self)->note_tick(input, result);
}

void ThreadedStage::note_tick(const ServoInput& input, const ServoResult& result) noexcept {
  arming_.store(result.arming);
  safety_.store(result.faults);
  told_.store(input.state.faults);
  told_since_.fetch_or(input.state.faults);
  const hal::ServoLoopCounters& counters = loop_.loop().counters();
  if (input.now_ns > stalled_until_ns_.load() + 2 * period_ns_)
    raise(tick_late_ns_, std::max(counters.last_lateness_ns, counters.last_tick_ns));
  const FaultCause cause = spoil_.load();
  if (cause != FaultCause::kNothing) loop_.loop().publish_instead(spoiled(cause, result.command));
  if (heap_calls_ == nullptr) return;
  // A new servo thread begins with a tick of number 1.
  const std::uint64_t calls = heap_calls_();
  if (counters.ticks > 1) servo_calls_.fetch_add(calls - servo_calls_before_);
  servo_calls_before_ = calls;
}

// When this is called the report's own transfer is not yet submitted again; when something is sent,
// it is.
void ThreadedStage::on_report(std::int64_t /*stamp_ns*/, std::span<const std::uint8_t> /*report*/,
                              hal::ReportVerdict /*verdict*/, std::uint64_t /*sequence*/) noexcept {
  ++submits_;
}

void ThreadedStage::on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
                            const hal::GuardedOutput& /*output*/) noexcept {
  ++submits_;
  SentBytes sent;
  sent.stamp_ns = stamp_ns;
  sent.size = static_cast<std::uint32_t>(std::min(report.size(), sent.bytes.size()));
  std::copy_n(report.begin(), sent.size, sent.bytes.begin());
  if (!sent_.push(sent)) lost_sends_.fetch_add(1);
  if (heap_calls_ != nullptr) usb_calls_.store(static_cast<std::int64_t>(heap_calls_()) - submits_);
}

void ThreadedStage::on_link(std::int64_t /*stamp_ns*/, LinkState /*state*/,
                            hal::HalStatus /*why*/) noexcept {}

}  // namespace haptic::sim
