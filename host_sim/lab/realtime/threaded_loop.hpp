// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The whole stack as a program has it, in real time: the USB thread with libusb on the bus inside
/// this process, the servo thread with its loop, between them the mailbox; on the bus the reference
/// device with the hand on it. Or the same without a bus: the device's bytes are handed over.

#include <pthread.h>

#include <atomic>
#include <csignal>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <thread>
#include <vector>

#include "hal/clock/linux_process.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/local/local_link.hpp"
#include "hal/realtime/servo_loop.hpp"
#include "hal/usb/usb_link.hpp"
#include "hal/usb/usb_thread.hpp"
#include "host_sim/device/device_stack.hpp"
#include "host_sim/device/reference_peer.hpp"

namespace haptic::sim {

struct ThreadedLoopSettings {
  StackSettings stack;  ///< the period of its limits is that of the servo loop
  /// Without a bus: the thread of the link plays the device, whose periods it lets pass by the
  /// clock (ReferencePeer). Nothing is plugged in or unplugged then.
  bool without_bus = false;
  /// SCHED_FIFO; 0: ordinary. The device's thread stands for hardware and goes above both.
  int servo_priority = 80, usb_priority = 79, device_priority = 81;
  /// Clock of the link and of the ticks, called on their threads; null: CLOCK_MONOTONIC, which it
  /// must give.
  std::int64_t (*link_clock)(void* context) = nullptr;
  std::int64_t (*link_slept)(void* context) = nullptr;
  std::int64_t (*tick_clock)(void* context) = nullptr;
  void* clock_context = nullptr;
};

/// What the operating system did not grant: errno of each; 0: granted or not asked for.
struct LoopGrants {
  int memory_lock = 0, idle_states = 0, device_priority = 0, usb_priority = 0, servo_priority = 0;
  [[nodiscard]] bool fifo() const {
    return device_priority == 0 && usb_priority == 0 && servo_priority == 0;
  }
};

/// Owner: one thread. The session outlives it. The program links haptic_usbfs.
class ThreadedLoop {
 public:
  /// @throws tools::InputError  a setting out of range.
  ThreadedLoop(CoreSession& session, const ThreadedLoopSettings& settings,
               std::function<HandAction(double t_s)> hand);
  ~ThreadedLoop();
  ThreadedLoop(const ThreadedLoop&) = delete;
  ThreadedLoop& operator=(const ThreadedLoop&) = delete;

  // Before `start`.
  void watch(hal::TickWatch called, void* context);
  void observe(hal::LinkObserver* observer) { link_->observe(observer); }
  /// `called` in each tick, after its step: stands for more work of the tick, and work_of counts
  /// it.
  void add_work(void (*called)(void* context, std::uint64_t tick), void* context);

  /// Plugs the device in and starts the two threads; the servo loop's deadlines are at `phase_ns`
  /// plus whole periods. With `paced`: also a thread on which the device's periods pass; else the
  /// caller lets them pass by `bus().step()`. @throws std::runtime_error  no thread could be made.
  void start(std::int64_t phase_ns, bool paced);
  /// Ends them in order; the force ramps to zero where the device's periods still pass.
  void stop();

  /// Another servo process after the one that ended: its loop, history and mailbox start again.
  /// `release` is called when the link listens to the new one and the old thread may go.
  void restart_servo(const std::function<void()>& release);
  /// Runs `handler` of that signal on the servo thread, where it is: asleep between two ticks as a
  /// rule, which then makes the wake-up late.
  void interrupt_servo(int signal) { static_cast<void>(pthread_kill(servo_, signal)); }

  /// The time that the work of each tick takes by itself [ns]: the same inputs, all since the start
  /// of the loop, one after the other on the same core without sleep, `repeats` times; the least of
  /// each tick counts. Where a command is not the one in `commands`, that of the loop, the tick's
  /// time is -1: the work was another one. After `stop`.
  [[nodiscard]] std::vector<std::int64_t> work_of(std::span<const ServoInput> inputs,
                                                  std::span<const DeviceCommand> commands,
                                                  unsigned repeats);

  [[nodiscard]] ReferenceUsb& bus() { return bus_; }
  /// On the device's thread, from within the hand's function alone: else bus().with_model.
  [[nodiscard]] const ReferenceModel& model() const { return model_; }
  [[nodiscard]] hal::DeviceLink& link() { return *link_; }
  /// With a bus.
  [[nodiscard]] hal::UsbLink& usb_link() { return *usb_link_; }
  [[nodiscard]] hal::ServoLoop& loop() { return *loop_; }
  [[nodiscard]] LoopGrants grants() const;
  /// errno that ended the servo loop; 0: none.
  [[nodiscard]] int servo_error() const { return servo_error_.load(); }

 private:
  void make_servo();
  void start_servo();
  void join_servo();
  static void* servo_entry(void* self);
  void run_servo() noexcept;
  static void saw(void* self, const ServoInput& input, const ServoResult& result);

  CoreSession& session_;
  ThreadedLoopSettings settings_;
  ReferenceModel model_;
  ReferenceUsb bus_;
  hal::ReferenceDriver driver_;
  std::unique_ptr<hal::MailboxMemory> mailboxes_[2];  ///< of this servo process and the last one
  std::unique_ptr<ReferencePeer> peer_;               ///< without a bus
  std::unique_ptr<hal::DeviceLink> link_;
  hal::UsbLink* usb_link_ = nullptr;  ///< with one: link_
  std::unique_ptr<hal::UsbThread> usb_;
  std::unique_ptr<ServoTick> tick_;
  std::unique_ptr<hal::ServoLoop> loop_;
  hal::RealtimeProcess process_;
  LoopGrants grants_;
  hal::TickWatch watch_ = nullptr;
  void* watch_context_ = nullptr;
  void (*work_)(void* context, std::uint64_t tick) = nullptr;
  void* work_context_ = nullptr;
  std::int64_t phase_ns_ = 0;
  pthread_t servo_{};
  std::thread device_;
  std::atomic<int> servo_error_{0}, servo_priority_error_{0}, device_priority_error_{0};
  std::atomic<bool> stop_{false}, device_runs_{false}, servo_ready_{false};
  bool started_ = false, servo_started_ = false;
};

/// Asks for SCHED_FIFO and a short timer slack for the calling thread; returns the errno.
int take_priority(int priority) noexcept;
/// Back to an ordinary thread.
void give_priority_back() noexcept;

}  // namespace haptic::sim
