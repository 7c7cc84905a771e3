// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The parent process holds the device, a child computes the force. However the child ends, the
/// parent's USB thread ramps the force to zero, the last ticks are read out of shared memory, and a
/// spare child can take over.
///
///     DeviceGuardian guardian(settings);
///     guardian.start(body);                               // forks: before any thread or device
///     UsbLink link(driver, guardian.mailbox(), link_settings);
///     guardian.hold(link);                                // the USB thread
///     return guardian.run(told);                          // until a signal or the servo's end

#include <atomic>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hal/device_link.hpp"
#include "hal/device_mailbox.hpp"
#include "hal/realtime/servo_process.hpp"
#include "hal/realtime/shared_memory.hpp"
#include "hal/usb/usb_thread.hpp"
#include "rt_core/exchange/step_trace.hpp"

namespace haptic::hal {

/// Exit codes of a program that is a guardian.
inline constexpr int kGuardianDone = 0, kGuardianServoFailed = 1, kGuardianOsRefused = 4;

struct GuardianSettings {
  /// Processes forked after the first, asleep until one of them has to take over. A fork after the
  /// USB thread has begun would copy its locks, and the device's descriptor.
  unsigned spares = 1;
  std::size_t recorded_ticks = 4096;  ///< of each process's flight recorder
  int stop_wait_ms = 500;             ///< for a servo process that was asked to stop; then killed
  UsbThreadSettings thread;
};

/// What a servo process works with, all in shared memory and its own alone: what a killed one has
/// left half done is not used again.
struct ServoSeat {
  unsigned number = 0;  ///< 0: the first; spares from 1 on
  DeviceMailbox& mailbox;
  std::span<std::byte> flight;    ///< for a FlightRecorder, which the body makes
  const std::atomic<bool>& stop;  ///< for ServoLoop::run; also set by SIGTERM to the process
};

/// Body of a servo process; its result is the exit code. Runs with SIGINT ignored: at a terminal it
/// goes to all, and the parent tells when to stop.
using ServoBody = std::function<int(const ServoSeat& seat)>;

/// An end that nobody asked for.
struct ServoEnd {
  unsigned number = 0;
  int pid = -1;
  ProcessEnd end;
  std::vector<StepTrace> records;  ///< of its flight recorder, oldest first
};

enum class GuardianNews : std::uint8_t {
  kNone = 0,
  kStopAsked,  ///< SIGINT or SIGTERM
  kServoEnded  ///< see servo_end(); the force is on its way to zero
};

/// Owner: one thread, which outlives the processes. While it is started, SIGINT and SIGTERM are
/// blocked in that thread and those that it makes. A frozen process is not an ended one: its force
/// is ramped down as stale (OutputGuard), and `stop` kills it.
class DeviceGuardian {
 public:
  explicit DeviceGuardian(const GuardianSettings& settings) : settings_(settings) {}
  ~DeviceGuardian();  ///< as `stop`
  DeviceGuardian(const DeviceGuardian&) = delete;
  DeviceGuardian& operator=(const DeviceGuardian&) = delete;

  /// Forks the servo process and its spares; the first begins at once. Once.
  /// @return 0, or an errno (EAGAIN, ENOMEM of fork; ENOMEM of shared memory; EBUSY: started).
  int start(const ServoBody& body);

  /// Of the process at work. Started.
  [[nodiscard]] DeviceMailbox& mailbox() noexcept;
  [[nodiscard]] int pid() const noexcept;
  [[nodiscard]] unsigned number() const noexcept { return at_work_; }
  /// Newest ticks of the process at work, oldest first; also while it runs.
  [[nodiscard]] std::vector<StepTrace> flight() const;

  /// Starts the USB thread over `link`, which was made over mailbox() and outlives this object.
  UsbThreadGrant hold(DeviceLink& link);

  /// Waits at most `timeout_ms` (negative: without end) for news; may return without any before.
  /// At the end of the process at work, which is reported once, the ramp is begun first of all.
  [[nodiscard]] GuardianNews wait(int timeout_ms);
  [[nodiscard]] const ServoEnd& servo_end() const noexcept { return end_; }

  /// A spare goes to work in place of a process that has ended. Its ticks count from 1 and it knows
  /// of no arming: the output stays at zero until the operator releases the deadman switch and
  /// presses it again.
  /// @return false: no spare is left, or the process at work has not ended.
  bool take_over();

  /// Orderly end: the processes are asked to stop, the force ramps to zero, the device is closed,
  /// and who still runs is killed. Bounded: UsbThread::stop and stop_wait_ms. Again: nothing.
  /// @return whether all of them ended when asked, without being killed.
  bool stop();

  /// `wait`, `take_over` and at last `stop`, until a signal, a servo process that returned, or no
  /// spare. `told`: of each end that nobody asked for, while the ramp is under way.
  /// @return an exit code: the servo's where it returned one of 0 to 4, kGuardianServoFailed where
  ///   one was killed or returned another, kGuardianDone after a signal.
  int run(const std::function<void(const ServoEnd&)>& told);

 private:
  struct Control;
  struct Seat {
    Control* control = nullptr;
    std::span<std::byte> flight;
    ServoProcess process;
  };
  int take_signals() noexcept;
  void give_signals_back() noexcept;
  [[nodiscard]] bool stop_asked() noexcept;
  [[nodiscard]] int sit(unsigned number, const ServoBody& body);
  [[nodiscard]] static std::vector<StepTrace> flight_of(const Seat& seat);

  GuardianSettings settings_;
  std::optional<SharedMemory> memory_;
  std::vector<std::unique_ptr<Seat>> seats_;
  unsigned at_work_ = 0;
  bool told_ = false;  ///< of the end of the process at work
  bool orderly_ = true, stopped_ = false;
  ServoEnd end_;
  DeviceLink* link_ = nullptr;
  std::unique_ptr<UsbThread> thread_;
  int signals_ = -1;  ///< signalfd
  sigset_t mask_before_{};
};

}  // namespace haptic::hal
