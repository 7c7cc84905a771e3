// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The whole stack as a program has it, in real time: the USB thread with libusb on the bus inside
/// this process, the servo thread with its loop, between them the mailbox; on the bus the reference
/// device with the hand on it.

#include <pthread.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>

#include "hal/clock/linux_process.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/realtime/servo_loop.hpp"
#include "hal/usb/usb_link.hpp"
#include "hal/usb/usb_thread.hpp"
#include "host_sim/device/device_stack.hpp"

namespace haptic::sim {

struct ThreadedLoopSettings {
  StackSettings stack;  ///< the period of its limits is that of the servo loop
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

  /// Plugs the device in and starts the two threads; the servo loop's deadlines are at `phase_ns`
  /// plus whole periods. With `paced`: also a thread on which the device's periods pass; else the
  /// caller lets them pass by `bus().step()`. @throws std::runtime_error  no thread could be made.
  void start(std::int64_t phase_ns, bool paced);
  /// Ends them in order; the force ramps to zero where the device's periods still pass.
  void stop();

  /// Another servo process after the one that ended: its loop, history and mailbox start again.
  /// `release` is called when the link listens to the new one and the old thread may go.
  void restart_servo(const std::function<void()>& release);

  [[nodiscard]] ReferenceUsb& bus() { return bus_; }
  /// On the device's thread, from within the hand's function alone: else bus().with_model.
  [[nodiscard]] const ReferenceModel& model() const { return model_; }
  [[nodiscard]] hal::UsbLink& link() { return *link_; }
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

  CoreSession& session_;
  ThreadedLoopSettings settings_;
  ReferenceModel model_;
  ReferenceUsb bus_;
  hal::ReferenceDriver driver_;
  std::unique_ptr<hal::MailboxMemory> mailboxes_[2];  ///< of this servo process and the last one
  std::unique_ptr<hal::UsbLink> link_;
  std::unique_ptr<hal::UsbThread> usb_;
  std::unique_ptr<ServoTick> tick_;
  std::unique_ptr<hal::ServoLoop> loop_;
  hal::RealtimeProcess process_;
  LoopGrants grants_;
  hal::TickWatch watch_ = nullptr;
  void* watch_context_ = nullptr;
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
