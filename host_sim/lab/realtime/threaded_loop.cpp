// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/realtime/threaded_loop.hpp"

#include <sched.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "hal/clock/servo_clock.hpp"

namespace haptic::sim {
namespace {

constexpr std::size_t kServoStackBytes = 1024 * 1024;
/// The phase of the loop is that of its start: a start that came later than this share of the
/// period is tried again.
constexpr std::int64_t kStartShare = 10;
constexpr int kStartTrials = 50;

ServoParameters servo_parameters(const CoreSession& session, const StackSettings& stack) {
  ServoParameters parameters;
  parameters.map = stack.map;
  parameters.limits = stack.limits;
  parameters.envelope = stack.envelope;
  const double* grip = session.view().bodies()[0].reference_m;
  for (int k = 0; k < 3; ++k) parameters.map.grip_a[k] = static_cast<Real>(grip[k]);
  return parameters;
}

int error_of(std::span<const hal::StepGrant> grants, hal::StartStep step) {
  for (const hal::StepGrant& grant : grants) {
    if (grant.step == step) return grant.error;
  }
  return 0;
}

bool same_command(const DeviceCommand& l, const DeviceCommand& r) {
  return l.tick == r.tick && l.sequence == r.sequence && l.arming == r.arming &&
         std::ranges::equal(l.wrench_d.force_n, r.wrench_d.force_n) &&
         std::ranges::equal(l.wrench_d.torque_nm, r.wrench_d.torque_nm);
}

}  // namespace

int take_priority(int priority) noexcept {
  static_cast<void>(hal::set_timer_slack(1));
  return priority > 0 ? hal::set_fifo_priority(priority) : 0;
}

void give_priority_back() noexcept {
  const sched_param ordinary{};
  static_cast<void>(pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary));
}

ThreadedLoop::ThreadedLoop(CoreSession& session, const ThreadedLoopSettings& settings,
                           std::function<HandAction(double t_s)> hand)
    : session_(session),
      settings_(settings),
      model_(settings.stack.model, std::move(hand)),
      bus_(model_, DevicePace::kRealTime) {
  mailboxes_[0] = std::make_unique<hal::MailboxMemory>();
  const StackSettings& stack = settings_.stack;
  hal::LinkSettings link;
  link.limits = stack.limits;
  link.deadman = SwitchMap{}.deadman;
  link.answer_wait_ns = stack.report_clocked ? stack.limits.period_ns : 0;
  link.wake_servo = stack.report_clocked;
  link.retry_ns = 20 * stack.limits.period_ns;
  link.clock = settings_.link_clock;
  link.slept = settings_.link_slept;
  link.clock_context = settings_.clock_context;
  if (settings_.without_bus) {
    peer_ = std::make_unique<ReferencePeer>(model_);
    link_ = std::make_unique<hal::LocalLink>(driver_, *mailboxes_[0], *peer_, link);
  } else {
    auto usb_link = std::make_unique<hal::UsbLink>(driver_, *mailboxes_[0], link);
    usb_link_ = usb_link.get();
    link_ = std::move(usb_link);
    bus_.on_replug([this](int descriptor) { usb_link_->set_wrapped_fd(descriptor); });
  }
  hal::UsbThreadSettings usb;
  usb.period_ns = stack.limits.period_ns;
  usb.priority = settings_.usb_priority;
  usb_ = std::make_unique<hal::UsbThread>(*link_, usb);
  make_servo();
}

ThreadedLoop::~ThreadedLoop() { stop(); }

void ThreadedLoop::watch(hal::TickWatch called, void* context) {
  watch_ = called;
  watch_context_ = context;
}

void ThreadedLoop::add_work(void (*called)(void* context, std::uint64_t tick), void* context) {
  work_ = called;
  work_context_ = context;
}

void ThreadedLoop::saw(void* self, const ServoInput& input, const ServoResult& result) {
  auto& loop = *static_cast<ThreadedLoop*>(self);
  if (loop.work_ != nullptr) loop.work_(loop.work_context_, result.command.tick);
  if (loop.watch_ != nullptr) loop.watch_(loop.watch_context_, input, result);
}

void ThreadedLoop::make_servo() {
  session_.core().reset();
  tick_ = std::make_unique<ServoTick>(session_.core(), servo_parameters(session_, settings_.stack),
                                      session_.view().header().capacity, nullptr);
  hal::ServoLoopSettings loop;
  loop.period_ns = settings_.stack.limits.period_ns;
  loop.report_clocked = settings_.stack.report_clocked;
  loop.report_wait_ns = loop.period_ns + loop.period_ns / 2;
  loop.clock = settings_.tick_clock;
  loop.clock_context = settings_.clock_context;
  loop_ = std::make_unique<hal::ServoLoop>(*tick_, *mailboxes_[0], loop);
  loop_->watch(&ThreadedLoop::saw, this);
}

void ThreadedLoop::start(std::int64_t phase_ns, bool paced) {
  if (started_) return;
  started_ = true;
  phase_ns_ = phase_ns;
  const auto granted = process_.start({});
  grants_.memory_lock = error_of(granted, hal::StartStep::kMemoryLock);
  grants_.idle_states = error_of(granted, hal::StartStep::kIdleStates);
  if (usb_link_ != nullptr) usb_link_->set_wrapped_fd(bus_.plug());
  const hal::UsbThreadGrant usb = usb_->start();
  if (usb.create_error != 0) throw std::runtime_error("no thread for USB");
  grants_.usb_priority = usb.priority_error;
  start_servo();
  if (!paced || peer_ != nullptr) return;
  device_runs_.store(true);
  device_ = std::thread([this] {
    device_priority_error_.store(take_priority(settings_.device_priority));
    bus_.run_paced(device_runs_);
  });
}

void ThreadedLoop::stop() {
  if (!started_) return;
  started_ = false;
  usb_->stop();
  device_runs_.store(false);
  if (device_.joinable()) device_.join();
  join_servo();
}

void ThreadedLoop::start_servo() {
  stop_.store(false);
  servo_ready_.store(false);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  static_cast<void>(pthread_attr_setstacksize(&attributes, kServoStackBytes));
  const int error = pthread_create(&servo_, &attributes, servo_entry, this);
  pthread_attr_destroy(&attributes);
  if (error != 0) throw std::runtime_error("no thread for the servo loop");
  servo_started_ = true;
  servo_ready_.wait(false);
}

void ThreadedLoop::join_servo() {
  stop_.store(true);
  if (!servo_started_) return;
  pthread_join(servo_, nullptr);
  servo_started_ = false;
}

void* ThreadedLoop::servo_entry(void* self) {
  static_cast<ThreadedLoop*>(self)->run_servo();
  return nullptr;
}

void ThreadedLoop::run_servo() noexcept {
  hal::ThreadSettings thread;
  thread.priority = settings_.servo_priority;
  const auto granted = hal::start_realtime_thread(thread);
  servo_priority_error_.store(error_of(granted, hal::StartStep::kPriority));
  hal::touch_heap();
  // The loop's first deadline is a period after its start.
  const std::int64_t period_ns = settings_.stack.limits.period_ns;
  servo_ready_.store(true);
  servo_ready_.notify_all();
  for (int trial = 0; trial < kStartTrials; ++trial) {
    const std::int64_t ahead = (hal::monotonic_ns() - phase_ns_) / period_ns + 1;
    const std::int64_t begin_ns = phase_ns_ + ahead * period_ns;
    static_cast<void>(hal::sleep_until(begin_ns));
    if (hal::monotonic_ns() - begin_ns < period_ns / kStartShare) break;
  }
  const int error = loop_->run(stop_);
  if (error != 0) servo_error_.store(error);
}

// The old thread may still tick once when it is let go; nobody listens to its mailbox any more.
void ThreadedLoop::restart_servo(const std::function<void()>& release) {
  std::swap(mailboxes_[0], mailboxes_[1]);
  mailboxes_[0] = std::make_unique<hal::MailboxMemory>();
  link_->use_mailbox(*mailboxes_[0]);
  stop_.store(true);
  release();
  join_servo();
  make_servo();
  start_servo();
}

std::vector<std::int64_t> ThreadedLoop::work_of(std::span<const ServoInput> inputs,
                                                std::span<const DeviceCommand> commands,
                                                unsigned repeats) {
  std::vector<std::int64_t> work_ns(inputs.size(), -1);
  std::vector<bool> differs(inputs.size(), false);
  const SceneCapacity& capacity = session_.view().header().capacity;
  for (unsigned repeat = 0; repeat < repeats; ++repeat) {
    session_.core().reset();
    ServoTick tick(session_.core(), servo_parameters(session_, settings_.stack), capacity, nullptr);
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      const std::int64_t begin_ns = hal::monotonic_ns();
      const ServoResult result = tick.step(inputs[k]);
      if (work_ != nullptr) work_(work_context_, result.command.tick);
      const std::int64_t took_ns = hal::monotonic_ns() - begin_ns;
      work_ns[k] = work_ns[k] < 0 ? took_ns : std::min(work_ns[k], took_ns);
      if (!same_command(result.command, commands[k])) differs[k] = true;
    }
  }
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    if (differs[k]) work_ns[k] = -1;
  }
  return work_ns;
}

LoopGrants ThreadedLoop::grants() const {
  LoopGrants grants = grants_;
  grants.servo_priority = servo_priority_error_.load();
  grants.device_priority = device_priority_error_.load();
  return grants;
}

}  // namespace haptic::sim
