// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The parent process holds the device, or two of them, a child computes the force. However the
/// child ends or hangs, the parent's USB thread ramps the force to zero, the last ticks are read
/// out of shared memory, and a spare child can take over. A third process takes the force away when
/// the parent itself is gone.
///
///     DeviceGuardian guardian(settings);
///     guardian.start(body);                               // forks: before any thread or device
///     UsbLink link(driver, guardian.mailbox(), link_settings);   // with guardian.keeper()
///     guardian.hold(link);                                // the USB thread
///     return guardian.run(told);                          // until a signal or the servo's end

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "hal/device_link.hpp"
#include "hal/device_mailbox.hpp"
#include "hal/realtime/servo_process.hpp"
#include "hal/realtime/shared_memory.hpp"
#include "hal/realtime/stop_signals.hpp"
#include "hal/realtime/zero_keeper.hpp"
#include "hal/usb/usb_thread.hpp"
#include "rt_core/exchange/step_trace.hpp"

namespace haptic::hal {

/// Exit codes of a program that is a guardian.
inline constexpr int kGuardianDone = 0, kGuardianServoFailed = 1, kGuardianOsRefused = 4;

/// Body of a watching process. It may read the flight recorders of the servo processes, by their
/// numbers and of each one by device, and has nothing else of them; nobody waits for it, and its
/// end changes nothing.
using WatcherBody = std::function<int(std::span<const std::span<const std::byte>> flights)>;

struct GuardianSettings {
  /// Processes forked after the first, asleep until one of them has to take over. A fork after the
  /// USB thread has begun would copy its locks, and the device's descriptor.
  unsigned spares = 1;
  std::size_t recorded_ticks = 4096;  ///< of each flight recorder: one for a process and device
  std::size_t report_bytes = 0;       ///< of ServoSeat::report
  std::size_t devices = 1;            ///< at most kMostDevices; each has its link and its keeper
  std::uint64_t order = 0;            ///< of every process, until `order` says another
  int stop_wait_ms = 500;             ///< for a servo process that was asked to stop; then killed
  /// A servo process that does not tick for so long is hung, and killed; only time in which this
  /// process looked counts. Before its first tick, which comes after its set-up, it has longer.
  int hung_ms = 250, first_tick_ms = 10'000;
  UsbThreadSettings thread;
  /// Runs in a process of its own, in time that nobody else wants (SCHED_IDLE); empty: none does.
  WatcherBody watcher;
  /// Another program may read what the servo processes write: DeviceGuardian::reports.
  bool has_reader = false;
};

/// Memory that one servo process writes, for a reader in another program.
struct ServoReports {
  int descriptor = -1;                ///< of the guardian; it can be mapped read-only alone
  std::span<const std::byte> memory;  ///< the same, as it is mapped here
  std::array<std::span<const std::byte>, kMostDevices> flights;  ///< of it, by device
  std::span<const std::byte> report;                             ///< of it: ServoSeat::report
};

/// The memory of one servo process, all of it shared and none of it its spare's: what a killed
/// process has left half done is not used again. The parts that the guardian writes are read-only
/// in the servo process.
struct ServoSeat {
  unsigned number = 0;                            ///< 0: the first; spares from 1 on
  std::span<const DeviceMailbox> mailboxes;       ///< by device
  std::span<const std::span<std::byte>> flights;  ///< by device; of a FlightRecorder that it makes
  std::span<std::byte> report;    ///< zeroed, aligned to 64: what the body tells of itself
  const std::atomic<bool>& stop;  ///< for ServoLoop::run
  const std::atomic<std::uint64_t>& order;  ///< DeviceGuardian::order
};

/// Body of a servo process; its result is the exit code. Runs with all signals ignored that the
/// parent follows: those to a whole group are not its business, the parent tells when to stop.
using ServoBody = std::function<int(const ServoSeat& seat)>;

/// An end that nobody asked for.
struct ServoEnd {
  unsigned number = 0;
  int pid = -1;
  ProcessEnd end;
  bool hung = false;  ///< it had stopped ticking, and was killed for it
  /// Ticks of its flight recorders, by device, oldest first.
  std::array<std::vector<StepTrace>, kMostDevices> records;
};

/// "did not tick for 250 ms (stopped) and was killed", or as of ProcessEnd.
[[nodiscard]] std::string to_text(const ServoEnd& end);

enum class GuardianNews : std::uint8_t {
  kNone = 0,
  kStopAsked,   ///< a signal, see stop_signal()
  kCalled,      ///< the descriptor of `listen` can be read
  kServoEnded,  ///< see servo_end(); the force is on its way to zero
  kKeeperEnded  ///< a zero-keeper, see keeper_end(); reported once
};

/// Owner: one thread, which outlives the processes. While it is started, the signals of StopSignals
/// are blocked in that thread and those that it makes.
class DeviceGuardian {
 public:
  explicit DeviceGuardian(const GuardianSettings& settings);
  ~DeviceGuardian();  ///< as `stop`
  DeviceGuardian(const DeviceGuardian&) = delete;
  DeviceGuardian& operator=(const DeviceGuardian&) = delete;

  /// Forks the zero-keepers, the servo process and its spares; the first servo begins at once.
  /// Once.
  /// @return 0, or an errno (EAGAIN, ENOMEM of fork; ENOMEM of shared memory; EBUSY: started).
  int start(const ServoBody& body);

  /// Mailbox of the process at work. Started.
  [[nodiscard]] const DeviceMailbox& mailbox(std::size_t device = 0) const noexcept {
    return seats_[at_work_]->mailboxes[device];
  }
  [[nodiscard]] int pid() const noexcept;
  [[nodiscard]] unsigned number() const noexcept { return at_work_; }
  /// ServoSeat::report of a seat, which that process may be writing to, anything.
  [[nodiscard]] std::span<std::byte> report(unsigned number) noexcept;
  /// A number for the process of a seat, to be read when it begins.
  void order(unsigned number, std::uint64_t value) noexcept;
  /// Memory of a seat; settings.has_reader, and started.
  [[nodiscard]] ServoReports reports(unsigned number) const;
  [[nodiscard]] unsigned seats() const noexcept { return static_cast<unsigned>(seats_.size()); }
  /// `wait` returns with kCalled while `descriptor` can be read or has been hung up; -1: none.
  void listen(int descriptor) noexcept { caller_ = descriptor; }
  /// Newest ticks of the process at work, oldest first; also while it runs.
  [[nodiscard]] std::vector<StepTrace> flight(std::size_t device = 0) const;
  /// For LinkSettings::zero_holder.
  [[nodiscard]] ZeroHolder& keeper(std::size_t device = 0) noexcept {
    return holds_[device].keeper;
  }
  [[nodiscard]] int keeper_pid(std::size_t device = 0) const noexcept {
    return holds_[device].keeper.pid();
  }
  [[nodiscard]] int watcher_pid() const noexcept { return watcher_.pid(); }  ///< -1: there is none

  /// Starts the USB thread over `link`, which was made over mailbox(device) and outlives it: until
  /// stop().
  UsbThreadGrant hold(DeviceLink& link, std::size_t device = 0);

  /// Waits at most `timeout_ms` (negative: without end) for news; may return without any before.
  /// At the end of the process at work, which is reported once, the ramp is begun first of all.
  [[nodiscard]] GuardianNews wait(int timeout_ms);
  [[nodiscard]] const ServoEnd& servo_end() const noexcept { return end_; }
  /// The end of the last keeper that ended, and whose device it kept.
  [[nodiscard]] const ProcessEnd& keeper_end() const noexcept {
    return holds_[ended_keeper_].keeper_end;
  }
  [[nodiscard]] std::size_t ended_keeper() const noexcept { return ended_keeper_; }
  [[nodiscard]] int stop_signal() const noexcept { return stop_signal_; }  ///< 0: none came
  /// How long the process at work has not ticked, as far as this process looked.
  [[nodiscard]] std::int64_t silence_ns() const noexcept { return silence_ns_; }

  /// A spare goes to work in place of a process that has ended. Its ticks count from 1 and it knows
  /// of no arming: the output stays at zero until the operator releases the deadman switch and
  /// presses it again. A spare that stands still is killed, and the next one taken.
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
  struct Orders;
  struct Reports;
  /// Memory of one process. Two mappings, each written by one side.
  struct Seat {
    Seat(std::size_t up_bytes, std::size_t down_bytes, SharedMemory::Readers readers)
        : up(up_bytes, readers), down(down_bytes) {}
    SharedMemory up, down;  ///< from the servo; from the guardian
    std::array<DeviceMailbox, kMostDevices> mailboxes;
    std::array<std::span<std::byte>, kMostDevices> flights;
    std::span<std::byte> report;
    Orders* orders = nullptr;
    ServoProcess process;
  };
  /// One device, as it is held.
  struct Hold {
    explicit Hold(std::size_t device) noexcept : keeper(device) {}
    ZeroKeeper keeper;
    ProcessEnd keeper_end;
    DeviceLink* link = nullptr;
    std::unique_ptr<UsbThread> thread;
  };
  [[nodiscard]] std::span<Hold> holds() noexcept {
    return std::span(holds_).first(settings_.devices);
  }
  void tell_servo_lost() noexcept;
  [[nodiscard]] int start_keepers();
  void stop_keepers() noexcept;
  [[nodiscard]] int make_seats();
  [[nodiscard]] int sit(unsigned number, const ServoBody& body);
  [[nodiscard]] int watch();
  void begin_seat(unsigned number) noexcept;
  void look_at_ticks() noexcept;
  [[nodiscard]] bool look_for_end();
  [[nodiscard]] bool look_for_keeper() noexcept;
  [[nodiscard]] static std::vector<StepTrace> flight_of(const Seat& seat, std::size_t device);

  GuardianSettings settings_;
  std::array<Hold, kMostDevices> holds_{{Hold{0}, Hold{1}}};
  std::size_t ended_keeper_ = 0;
  std::vector<std::unique_ptr<Seat>> seats_;
  unsigned at_work_ = 0;
  bool told_ = false;  ///< of the end of the process at work
  bool orderly_ = true, stopped_ = false;
  ServoEnd end_;
  int stop_signal_ = 0;
  int caller_ = -1;
  StopSignals signals_;
  // Observations of the process at work: its last tick, and how long it has been silent.
  std::unique_ptr<NewestReader<DeviceCommand>> ticks_;
  std::uint64_t tick_ = 0;
  std::int64_t looked_ns_ = 0, silence_ns_ = 0;
  bool hung_ = false;
  ServoProcess watcher_;
};

}  // namespace haptic::hal
