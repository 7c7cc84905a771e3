// SPDX-License-Identifier: Apache-2.0
// The stack in its two threads: the bits of the run in one, and what the servo thread asks of the
// C library and of the kernel: the clock, and the sleep between two ticks.
#include <doctest/doctest.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "hal/usb/usb_link.hpp"
#include "hal/usb/usb_thread.hpp"
#include "tests/host_sim/peg_minute.hpp"
#include "tests/support/os_call_guard.hpp"
#include "tests/support/rt_guard.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::test;

namespace {

// The stack as a program has it: libusb in the USB thread, the servo loop in a thread of its own,
// between them the mailbox. The device is the simulated one in lock-step and the clock is the
// device's own: a period is one of its periods however long the threads take, so that the run has
// the bits of the one in a single thread.

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
    hal::DeviceSide(mailbox_).publish({}, true);  // it sleeps
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
               mailbox_.states->published.load(std::memory_order_relaxed) &&
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
  hal::MailboxMemory mailbox_;
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

constexpr std::size_t kTicks = 12'000;
/// From here on the threads have settled; the hand presses from about 1.8 s on.
constexpr std::uint64_t kSettled = 100, kPressing = 5'000;

constexpr int kNoFilter = 77;  ///< exit code of a child whose kernel has none

struct SingleRun {
  std::vector<TickBits> bits;
  std::vector<haptic::DeviceState> states;
  std::size_t contact = 0;
};

SingleRun run_in_one_thread(std::size_t ticks) {
  CoreSession session(peg_scene(), "peg");
  DeviceStack stack(session, peg_settings(StackCarrier::kDirect, true),
                    scripted_hand(session, peg_motion(ticks), 1000));
  SingleRun run;
  for (std::size_t k = 0; k < ticks; ++k) {
    const StackTick tick = stack.step();
    run.contact += tick.servo.rendered.situation != ContactSituation::kNone ? 1u : 0u;
    run.bits.push_back(bits_of(tick.state, tick.servo));
    run.states.push_back(tick.state);
  }
  return run;
}

/// `work` in a process of its own; what it returns is the exit code.
template <typename Work>
int status_of_child(Work work) {
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const int code = work();
    ::_exit(code);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  return status;
}

bool killed_by_filter(int status) { return WIFSIGNALED(status) && WTERMSIG(status) == SIGSYS; }
bool without_filter(int status) { return WIFEXITED(status) && WEXITSTATUS(status) == kNoFilter; }

/// Both threads, the servo thread under a filter from kSettled on; `probe`: it asks for the
/// process' number, which is a system call, at kPressing.
int run_filtered(bool probe) {
  CoreSession session(peg_scene(), "peg");
  constexpr std::size_t kFiltered = kPressing + 1'000;
  std::atomic<int> refused{0};
  ThreadedStack stack(session, peg_settings(StackCarrier::kUsb, true),
                      scripted_hand(session, peg_motion(kFiltered), 1000), kFiltered,
                      [&](std::uint64_t sequence) {
                        constexpr std::array<int, 2> kAllowed = {SYS_futex, SYS_clock_gettime};
                        if (sequence == kSettled) refused.store(allow_only(kAllowed));
                        if (sequence == kPressing && probe) (void)::syscall(SYS_getpid);
                      });
  stack.run();
  // Not the orderly end: a thread that ends makes system calls.
  ::_exit(refused.load() != 0 ? kNoFilter : stack.stuck() ? 1 : 0);
}

/// Ticks of the loop at states that were recorded, from kPressing on with no system call allowed
/// but the one that ends the process.
int tick_filtered(const SingleRun& recorded, bool probe) {
  CoreSession session(peg_scene(), "peg");
  const StackSettings settings = peg_settings(StackCarrier::kDirect, true);
  ServoParameters parameters;
  parameters.map = settings.map;
  parameters.limits = settings.limits;
  const double* grip = session.view().bodies()[0].reference_m;
  for (int k = 0; k < 3; ++k) parameters.map.grip_a[k] = static_cast<Real>(grip[k]);
  ServoTick tick(session.core(), parameters, session.view().header().capacity, nullptr);
  hal::MailboxMemory mailbox;
  hal::DeviceSide device(mailbox);
  hal::ServoLoop loop(tick, mailbox, {});
  bool same = true;
  for (std::size_t k = 0; k < recorded.states.size(); ++k) {
    if (k == kPressing) {
      constexpr std::array<int, 1> kAllowed = {SYS_exit_group};
      if (allow_only(kAllowed) != 0) return kNoFilter;
    }
    device.publish(recorded.states[k], false);
    const ServoResult& result = loop.tick(recorded.states[k].stamp_ns, 0);
    same = same && bits_of(recorded.states[k], result) == recorded.bits[k];
    if (probe && k == kPressing + 500) (void)::syscall(SYS_getpid);
  }
  return same ? 0 : 1;
}

}  // namespace

TEST_SUITE("host_sim.threaded_stack") {
  TEST_CASE("two threads: the bits of one thread; no heap call, no lock, one sleep a tick") {
    const SingleRun single = run_in_one_thread(kTicks);
    CHECK(single.contact > 3 * kTicks / 10);
    CoreSession session(peg_scene(), "peg");
    std::optional<RtGuard> heap;
    std::optional<OsCallGuard> system;
    std::uint64_t heap_calls = 0;
    OsCalls calls;
    ThreadedStack stack(session, peg_settings(StackCarrier::kUsb, true),
                        scripted_hand(session, peg_motion(kTicks), 1000), kTicks,
                        [&](std::uint64_t sequence) {
                          if (sequence == kSettled) {
                            heap.emplace();
                            system.emplace();
                          } else if (sequence == kTicks) {
                            heap_calls = heap->heap_calls();
                            calls = system->calls();
                            heap.reset();
                            system.reset();
                          }
                        });
    stack.run();
    stack.stop();
    REQUIRE(!stack.stuck());
    CHECK(stack.error() == 0);
    const auto [at, other] = std::mismatch(single.bits.begin(), single.bits.end(),
                                           stack.bits().begin(), stack.bits().end());
    CHECK(static_cast<std::size_t>(at - single.bits.begin()) == kTicks);
    CHECK(stack.link().answers_late == 0u);
    CHECK(stack.link().disconnects == 0u);
    CHECK(heap_calls == 0u);
    CHECK(calls.locks == 0u);
    CHECK(calls.others == 0u);
    MESSAGE(kTicks, " ticks in two threads, ", single.contact, " in contact; from tick ", kSettled,
            " on: ", heap_calls, " heap calls, ", calls.locks, " locks, ", calls.others,
            " system calls, ", calls.sleeps, " sleeps, ", calls.clocks, " looks at the clock");
    if (!os_calls_are_counted()) return;
    CHECK(calls.sleeps > kTicks / 2);  // or it did not sleep in between
    CHECK(calls.clocks >= kTicks - kSettled);
  }

  TEST_CASE("the counters count") {
    if (!os_calls_are_counted()) return;
    std::mutex mutex;
    OsCalls calls;
    std::uint64_t heap_calls = 0;
    {
      const RtGuard heap;
      const OsCallGuard system;
      mutex.lock();
      mutex.unlock();
      std::this_thread::yield();
      (void)::syscall(SYS_getpid);
      (void)hal::monotonic_ns();
      void* volatile aligned = nullptr;
      void* block = nullptr;
      (void)!::posix_memalign(&block, 64, 64);
      aligned = block;
      std::free(aligned);
      calls = system.calls();
      heap_calls = heap.heap_calls();
    }
    CHECK(calls.locks == 1u);
    CHECK(calls.others == 2u);
    CHECK(calls.clocks == 1u);
    CHECK(calls.sleeps == 0u);
    CHECK(heap_calls == 2u);
  }

  TEST_CASE("kernel: a servo thread that may only sleep and look at the clock runs on") {
    if (!os_calls_are_counted()) return;
    static_cast<void>(peg_scene());
    const int status = status_of_child([] { return run_filtered(false); });
    if (without_filter(status)) {
      MESSAGE("skipped: this kernel gives no filter");
      return;
    }
    CHECK(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0);
    CHECK(killed_by_filter(status_of_child([] { return run_filtered(true); })));
  }

  TEST_CASE("kernel: a tick makes no system call at all") {
    if (!os_calls_are_counted()) return;
    const SingleRun recorded = run_in_one_thread(kPressing + 1'000);
    CHECK(recorded.contact > 1'000);
    const int status = status_of_child([&] { return tick_filtered(recorded, false); });
    if (without_filter(status)) {
      MESSAGE("skipped: this kernel gives no filter");
      return;
    }
    CHECK(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0);
    CHECK(killed_by_filter(status_of_child([&] { return tick_filtered(recorded, true); })));
  }
}
