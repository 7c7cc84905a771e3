// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The thread that owns a link: it polls until it is stopped, and closes the device itself. It has
/// its core and its real-time priority only while reports flow. What comes before and after them -
/// looking for a device, opening and starting it, closing it - takes long and is nobody's deadline:
/// at a priority it would hold up a loop of another process, and the thread that libusb starts for
/// itself would inherit priority and core.

#include <pthread.h>
#include <sched.h>

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "hal/device_link.hpp"

namespace haptic::hal {

struct UsbThreadSettings {
  std::int64_t period_ns = 1'000'000;  ///< of the loop; the thread polls with half of it
  int priority = 0;                    ///< SCHED_FIFO, just below the servo thread's; 0: ordinary
  int cpu = -1;                        ///< core that it is tied to; negative: any
  std::size_t prefault_bytes = 128 * 1024;      ///< of its stack, touched before the loop
  const char* name = "haptic-usb";              ///< at most 15 characters
  std::atomic<std::uint32_t>* turns = nullptr;  ///< grows with each poll; null: not counted
};

/// Grants of the operating system while reports flow, tried at the start; errno of each that it
/// refuses.
struct UsbThreadGrant {
  int create_error = 0;    ///< no thread at all
  int priority_error = 0;  ///< EPERM: no right to SCHED_FIFO; it runs as an ordinary thread then
  int affinity_error = 0;
  int priority = 0;  ///< SCHED_FIFO priority that it will have; 0: ordinary
  int cpu = -1;      ///< core that it will be tied to; negative: any
};

/// Owner: whoever starts it. The link outlives the thread.
class UsbThread {
 public:
  UsbThread(DeviceLink& link, const UsbThreadSettings& settings) noexcept;
  ~UsbThread() {
    stop();
    link_.watch_flow(nullptr, nullptr);
  }
  UsbThread(const UsbThread&) = delete;
  UsbThread& operator=(const UsbThread&) = delete;

  /// Returns once the thread is set up and about to poll, with what was granted. A refused priority
  /// or core is no failure; `create_error` is. Started already: the grant of then.
  UsbThreadGrant start() noexcept;

  /// The first half of `stop`, without waiting: of several threads that end together.
  void begin_stop() noexcept;
  /// Cancels what the link waits for, lets the thread close the device in order, joins it. Bounded
  /// by the link's own bounds. Does nothing when it does not run.
  void stop() noexcept;

  [[nodiscard]] bool running() const noexcept { return running_.load(std::memory_order_acquire); }
  /// Status of the last poll; from any thread.
  [[nodiscard]] HalStatus status() const noexcept {
    return status_.load(std::memory_order_acquire);
  }

 private:
  static void* entry(void* self);
  static void on_flow(void* self, bool flows) noexcept;
  void run() noexcept;
  void try_rights() noexcept;
  void take_rights() const noexcept;
  void give_rights_back() const noexcept;

  DeviceLink& link_;
  UsbThreadSettings settings_;
  UsbThreadGrant grant_;
  cpu_set_t cpus_before_{};  ///< where it may run while nothing flows
  pthread_t thread_{};
  bool started_ = false;
  std::uint32_t turns_ = 0;
  std::atomic<bool> ready_{false}, stopping_{false}, running_{false};
  std::atomic<HalStatus> status_{HalStatus::kDeviceNotFound};
};

}  // namespace haptic::hal
