// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/usb_loop_run.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "hal/device_limits.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/realtime/servo_loop.hpp"
#include "hal/usb/usb_thread.hpp"

namespace haptic::sim {
namespace {

constexpr std::size_t kStackBytes = 128 * 1024, kPageBytes = 4096;
constexpr std::chrono::milliseconds kLook{10};
/// Reports and sends kept per tick measured: more come where the loop is slower than the device.
constexpr std::uint64_t kRoomPerTick = 4;

/// Numbers of one thread in memory made before; beyond its room nothing is kept.
class Series {
 public:
  explicit Series(std::uint64_t room) : values_(room) {}
  void add(std::int64_t value) noexcept {
    if (count_ < values_.size()) values_[count_++] = value;
  }
  /// Differences of neighbours are what most are asked for.
  void add_step(std::int64_t stamp_ns) noexcept {
    if (last_ns_ != 0) add(stamp_ns - last_ns_);
    last_ns_ = stamp_ns;
  }
  void break_off() noexcept { last_ns_ = 0; }
  [[nodiscard]] Quantiles quantiles() const {
    return quantiles_of({values_.begin(), values_.begin() + static_cast<std::ptrdiff_t>(count_)});
  }

 private:
  std::vector<std::int64_t> values_;
  std::size_t count_ = 0;
  std::int64_t last_ns_ = 0;
};

/// On the USB thread.
class BusWatch final : public hal::LinkObserver {
 public:
  explicit BusWatch(std::uint64_t room) : reports(room), sends(room), answers(room) {}

  void on_report(std::int64_t stamp_ns, std::span<const std::uint8_t> /*report*/,
                 hal::ReportVerdict verdict, std::uint64_t /*sequence*/) noexcept override {
    if (!measured.load(std::memory_order_relaxed)) return;
    if (verdict == hal::ReportVerdict::kState) reports.add_step(stamp_ns);
    answered_ns_ = stamp_ns;
  }
  /// Called when the bus has taken the command.
  void on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> /*report*/,
               const hal::GuardedOutput& /*output*/) noexcept override {
    if (!measured.load(std::memory_order_relaxed)) return;
    sends.add_step(stamp_ns);
    if (answered_ns_ != 0) answers.add(hal::monotonic_ns() - answered_ns_);
    answered_ns_ = 0;
  }
  void on_link(std::int64_t /*stamp_ns*/, LinkState /*state*/,
               hal::HalStatus /*why*/) noexcept override {
    reports.break_off();
    sends.break_off();
    answered_ns_ = 0;
  }

  std::atomic<bool> measured{false};
  Series reports, sends, answers;

 private:
  std::int64_t answered_ns_ = 0;
};

/// On the servo thread, after each tick.
class TickCount {
 public:
  TickCount(const hal::ServoLoop& loop, BusWatch& bus, std::uint64_t ticks)
      : loop_(loop), bus_(bus), wanted_(ticks), lateness_(ticks), tick_(ticks) {}

  static void watch(void* self, const ServoInput& input, const ServoResult& result) {
    static_cast<TickCount*>(self)->take(input, result);
  }
  [[nodiscard]] bool begun() const { return begun_.load(std::memory_order_acquire); }
  [[nodiscard]] bool done() const { return done_.load(std::memory_order_acquire); }

  /// After the loop has ended.
  void tell(UsbLoopAccount& account) const {
    account = account_;
    account.lateness = lateness_.quantiles();
    account.tick = tick_.quantiles();
  }

 private:
  void take(const ServoInput& input, const ServoResult& result) noexcept {
    account_.armings = result.command.arming;
    if (account_.ticks == 0) {
      if (result.arming != ArmingState::kArmed) return;
      begun_.store(true, std::memory_order_release);
      bus_.measured.store(true, std::memory_order_relaxed);
    } else if (account_.ticks <= wanted_) {
      tick_.add(loop_.counters().last_tick_ns);  // of the tick before
    }
    if (account_.ticks == wanted_) {
      bus_.measured.store(false, std::memory_order_relaxed);
      done_.store(true, std::memory_order_release);
      return;
    }
    account_.ticks += 1;
    lateness_.add(loop_.counters().last_lateness_ns);
    const std::uint32_t missed = input.late_periods;
    account_.late[missed == 0 ? 0 : missed == 1 ? 1 : missed <= 5 ? 2 : 3] += 1;
    account_.armed_ticks += result.arming == ArmingState::kArmed ? 1u : 0u;
    account_.contact_ticks += result.rendered.d_near_m <= 0 ? 1u : 0u;
    account_.safety_faults |= result.faults;
    account_.device_faults |= input.state.faults;
    account_.largest_force_n =
        std::max(account_.largest_force_n,
                 static_cast<double>(vec3_of(result.command.wrench_d.force_n).norm()));
  }

  const hal::ServoLoop& loop_;
  BusWatch& bus_;
  const std::uint64_t wanted_;
  Series lateness_, tick_;
  UsbLoopAccount account_;
  std::atomic<bool> begun_{false}, done_{false};
};

// Touches the stack below, page by page.
[[gnu::noinline]] void prefault_stack() noexcept {
  volatile unsigned char stack[kStackBytes];
  stack[0] = 1;
  for (std::size_t k = kPageBytes; k < kStackBytes; k += kPageBytes) stack[k] = stack[0];
}

/// The servo thread: set up, then the loop until told to stop.
struct ServoThread {
  hal::ServoLoop& loop;
  int priority;
  std::atomic<bool> stop{false};
  int error = 0, priority_error = 0;
  pthread_t thread{};

  static void* entry(void* self) {
    auto& servo = *static_cast<ServoThread*>(self);
    prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
    if (servo.priority > 0) {
      sched_param parameters{};
      parameters.sched_priority = servo.priority;
      servo.priority_error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
    }
    prefault_stack();
    servo.error = servo.loop.run(servo.stop);
    return nullptr;
  }
  void start() {
    if (pthread_create(&thread, nullptr, entry, this) != 0)
      throw std::runtime_error("no thread for the servo loop");
  }
  void end() {
    stop.store(true, std::memory_order_relaxed);
    pthread_join(thread, nullptr);
  }
};

bool is_realtime_kernel() {
  std::ifstream file("/sys/kernel/realtime");
  int value = 0;
  return file >> value && value == 1;
}

ServoParameters servo_parameters(const CoreSession& session, const SafetyLimits& limits) {
  ServoParameters parameters;
  parameters.limits = limits;
  const double* grip = session.view().bodies()[0].reference_m;
  for (int k = 0; k < 3; ++k) parameters.map.grip_a[k] = static_cast<Real>(grip[k]);
  return parameters;
}

}  // namespace

Quantiles quantiles_of(std::vector<std::int64_t> values_ns) {
  Quantiles result;
  result.count = values_ns.size();
  if (values_ns.empty()) return result;
  std::sort(values_ns.begin(), values_ns.end());
  const double shares[] = {0.5, 0.99, 0.999, 1.0};
  for (std::size_t k = 0; k < result.at_ns.size(); ++k) {
    // The smallest value that this share of all does not exceed.
    const double rank = std::ceil(shares[k] * static_cast<double>(values_ns.size()));
    result.at_ns[k] = values_ns[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
  }
  return result;
}

UsbLoopAccount run_usb_loop(CoreSession& session, const UsbLoopSettings& settings) {
  const hal::DeviceCapabilities capabilities = hal::reference_capabilities();
  const std::int64_t period_ns =
      settings.period_ns > 0 ? settings.period_ns : capabilities.report_period_ns;
  hal::DeviceMailbox mailbox;
  hal::ReferenceDriver driver;
  hal::LinkSettings link_settings;
  link_settings.address = settings.address;
  link_settings.limits = hal::limits_of(capabilities, period_ns);
  link_settings.deadman = SwitchMap{}.deadman;
  hal::UsbLink link(driver, mailbox, link_settings);
  ServoTick tick(session.core(), servo_parameters(session, link_settings.limits),
                 session.view().header().capacity, nullptr);
  hal::ServoLoopSettings loop_settings;
  loop_settings.period_ns = period_ns;
  hal::ServoLoop loop(tick, mailbox, loop_settings);
  BusWatch bus(kRoomPerTick * settings.ticks);
  TickCount count(loop, bus, settings.ticks);
  link.observe(&bus);
  loop.watch(&TickCount::watch, &count);

  const int lock_error = mlockall(MCL_CURRENT | MCL_FUTURE) == 0 ? 0 : errno;
  hal::UsbThreadSettings usb_settings;
  usb_settings.period_ns = period_ns;
  usb_settings.priority = settings.usb_priority;
  hal::UsbThread usb(link, usb_settings);
  const hal::UsbThreadGrant grant = usb.start();
  if (grant.create_error != 0) throw std::runtime_error("no thread for USB");
  ServoThread servo{loop, settings.servo_priority};
  servo.start();

  rusage before{}, after{};
  const auto give_up =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(settings.patience_s);
  while (!count.begun() && std::chrono::steady_clock::now() < give_up)
    std::this_thread::sleep_for(kLook);
  getrusage(RUSAGE_SELF, &before);
  while (count.begun() && !count.done()) std::this_thread::sleep_for(kLook);
  getrusage(RUSAGE_SELF, &after);
  const hal::LinkCounters counters = link.counters();
  const std::string trouble = count.begun() ? "" : link.trouble();
  usb.stop();
  servo.end();
  (void)munlockall();

  UsbLoopAccount account;
  count.tell(account);
  account.report_interval = bus.reports.quantiles();
  account.send_interval = bus.sends.quantiles();
  account.answer = bus.answers.quantiles();
  account.minor_faults = static_cast<std::uint64_t>(after.ru_minflt - before.ru_minflt);
  account.major_faults = static_cast<std::uint64_t>(after.ru_majflt - before.ru_majflt);
  account.link = counters;
  account.servo_error = servo.error;
  account.servo_priority_error = servo.priority_error;
  account.usb_priority_error = grant.priority_error;
  account.lock_error = lock_error;
  account.realtime_kernel = is_realtime_kernel();
  account.trouble = trouble;
  return account;
}

}  // namespace haptic::sim
