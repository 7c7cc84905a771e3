// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The stack as a program has it: libusb in the USB thread, the servo loop in a thread of its own,
/// between them the mailbox. The device is the simulated one in lock-step and the clock is the
/// device's own: a period is one of its periods however long the threads take, so that the run has
/// the bits of the one in a single thread.

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>
#include <vector>

#include "hal/usb/usb_link.hpp"
#include "hal/usb/usb_thread.hpp"
#include "tests/host_sim/peg_minute.hpp"

namespace haptic::test {

/// Owner: one thread. `session` outlives it.
class ThreadedStack {
 public:
  /// Called on the servo thread after the tick at the report of that number.
  using OnReport = std::function<void(std::uint64_t sequence)>;

  ThreadedStack(sim::CoreSession& session, const sim::StackSettings& settings,
                std::function<sim::HandAction(double)> hand, std::size_t ticks, OnReport on_report)
      : period_ns_(settings.limits.period_ns),
        model_(settings.model, std::move(hand)),
        bus_(model_, sim::DevicePace::kLockStep),
        tick_(session.core(), parameters(session, settings), session.view().header().capacity,
              nullptr),
        loop_(tick_, mailbox_, loop_settings()),
        link_(driver_, mailbox_, link_settings(settings)),
        usb_(link_, {}),
        bits_(ticks),
        on_report_(std::move(on_report)) {
    loop_.watch(&ThreadedStack::saw, this);
  }
  ~ThreadedStack() { stop(); }
  ThreadedStack(const ThreadedStack&) = delete;
  ThreadedStack& operator=(const ThreadedStack&) = delete;

  /// Starts both threads; returns when all reports have been answered, or none came for long.
  void run() {
    servo_ = std::thread([this] { error_ = loop_.run(stop_); });
    while (!looping_.load(std::memory_order_acquire)) std::this_thread::yield();
    if (usb_.start().create_error != 0) return;
    const auto nap = std::chrono::milliseconds(1);
    while (answered_.load(std::memory_order_acquire) < bits_.size() && !stuck_.load())
      std::this_thread::sleep_for(nap);
    counters_ = link_.counters();
  }

  /// Ends both threads, the USB thread first: it needs the other's answers for an orderly end.
  void stop() {
    stopping_.store(true);
    usb_.stop();
    stop_.store(true);
    if (!servo_.joinable()) return;
    publish_state(mailbox_, {}, true);  // it sleeps
    servo_.join();
  }

  // After stop().
  [[nodiscard]] const std::vector<TickBits>& bits() const { return bits_; }
  [[nodiscard]] bool stuck() const { return stuck_.load(); }
  [[nodiscard]] int error() const { return error_; }
  /// When all were answered: on its way down the link waits for no answers.
  [[nodiscard]] const hal::LinkCounters& link() const { return counters_; }

 private:
  static constexpr std::int64_t kFirst_ns = 1'000'000'000, kNever_ns = 60'000'000'000;

  static ServoParameters parameters(const sim::CoreSession& session,
                                    const sim::StackSettings& settings) {
    ServoParameters p;
    p.map = settings.map;
    p.limits = settings.limits;
    const double* grip = session.view().bodies()[0].reference_m;
    for (int k = 0; k < 3; ++k) p.map.grip_a[k] = static_cast<Real>(grip[k]);
    return p;
  }
  hal::ServoLoopSettings loop_settings() {
    hal::ServoLoopSettings s;
    s.period_ns = period_ns_;
    s.report_clocked = true;
    s.report_wait_ns = kNever_ns;  // a tick for each report and none besides
    s.clock = &ThreadedStack::servo_clock;
    s.clock_context = this;
    return s;
  }
  hal::LinkSettings link_settings(const sim::StackSettings& settings) {
    hal::LinkSettings s;
    s.address.wrapped_fd = bus_.plug();
    s.limits = settings.limits;
    s.deadman = SwitchMap{}.deadman;
    s.answer_wait_ns = period_ns_;
    s.wake_servo = true;
    s.clock = &ThreadedStack::usb_clock;
    s.clock_context = this;
    return s;
  }

  // The link asks for the time before its next action, so this is where it waits until the
  // servo thread has seen all that was published.
  static std::int64_t usb_clock(void* self) {
    auto& stack = *static_cast<ThreadedStack*>(self);
    stack.wait_for_servo();
    const auto periods = static_cast<std::int64_t>(stack.bus_.periods());
    const std::int64_t now_ns = kFirst_ns + periods * stack.period_ns_;
    stack.now_ns_.store(now_ns, std::memory_order_release);
    return now_ns;
  }
  void wait_for_servo() {
    using Clock = std::chrono::steady_clock;
    constexpr auto kLongest = std::chrono::seconds(20);
    const Clock::time_point begin = Clock::now();
    while (ticks_.load(std::memory_order_acquire) <
               mailbox_.states_published.load(std::memory_order_relaxed) &&
           !stopping_.load(std::memory_order_relaxed)) {
      if (Clock::now() - begin > kLongest) {
        stuck_.store(true);
        return;
      }
      std::this_thread::yield();
    }
  }

  static std::int64_t servo_clock(void* self) {
    auto& stack = *static_cast<ThreadedStack*>(self);
    stack.looping_.store(true, std::memory_order_release);
    return stack.now_ns_.load(std::memory_order_acquire);
  }
  static void saw(void* self, const ServoInput& input, const ServoResult& result) {
    auto& stack = *static_cast<ThreadedStack*>(self);
    const std::uint64_t sequence = input.state.sequence;
    if (result.rendered_new && sequence <= stack.bits_.size()) {
      stack.bits_[sequence - 1] = bits_of(input.state, result);
      if (stack.on_report_) stack.on_report_(sequence);
      stack.answered_.store(sequence, std::memory_order_release);
    }
    stack.ticks_.fetch_add(1, std::memory_order_release);
  }

  const std::int64_t period_ns_;
  sim::ReferenceModel model_;
  sim::ReferenceUsb bus_;
  hal::ReferenceDriver driver_;
  hal::DeviceMailbox mailbox_;
  std::atomic<std::int64_t> now_ns_{kFirst_ns};
  ServoTick tick_;
  hal::ServoLoop loop_;
  hal::UsbLink link_;
  hal::UsbThread usb_;
  hal::LinkCounters counters_;
  std::thread servo_;
  std::vector<TickBits> bits_;
  OnReport on_report_;
  std::atomic<std::uint64_t> answered_{0};
  std::atomic<std::uint32_t> ticks_{0};
  std::atomic<bool> looping_{false}, stop_{false}, stopping_{false}, stuck_{false};
  int error_ = 0;
};

}  // namespace haptic::test
