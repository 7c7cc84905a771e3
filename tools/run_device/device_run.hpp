// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One run of a device, or of two: guardian, servo process and its spare, a link and its thread for
/// each device; the state of all of it while it runs, and the account at its end.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "hal/device_link.hpp"
#include "hal/realtime/device_guardian.hpp"
#include "hal/usb/usb_link.hpp"
#include "tools/run_device/device_config.hpp"
#include "tools/run_device/link_watch.hpp"
#include "tools/run_device/run_events.hpp"
#include "tools/run_device/run_session.hpp"
#include "tools/run_device/servo_program.hpp"
#include "tools/run_device/simulated_peer.hpp"

namespace haptic::tools {

/// When a run ends by itself; 0: not for that.
struct RunLength {
  double seconds = 0;       ///< since the device is held, or waited for
  std::uint64_t ticks = 0;  ///< from the first armed one on, and the account is of these
};

/// Something that Linux did not grant.
struct Refusal {
  std::string what;  ///< "servo process: memory lock"
  int error = 0;     ///< errno
};

/// A device's own statement at its last connection.
struct StatedDevice {
  std::string name, serial;  ///< empty: not stated
  double latency_s = 0;
  bool is_displacement = false, gives_force = false;
};

/// For people who watch, of one device: what it is handed is told by its link, not by who asked
/// for it.
struct RunStatus {
  unsigned device = 0;                ///< 1 and 2 of two; 0: there is one
  double t_s = 0;                     ///< since the device is held
  double force_n = 0, torque_nm = 0;  ///< handed to the device last
  std::uint32_t link_faults = 0;      ///< DeviceFault, for which the guard holds back
  std::int64_t silence_ns = 0;        ///< since the servo process ticked last
  ServoStatus servo;                  ///< its last word
  LinkState link = LinkState::kAbsent;
  hal::LinkCounters counters;
  std::string trouble;  ///< of the link; empty: none
  StatedDevice stated;
  std::optional<double> gap_m;  ///< of its gripper

  /// The servo's word is not of now.
  [[nodiscard]] bool is_silent() const { return silence_ns > kSilent_ns; }
  [[nodiscard]] std::uint32_t device_faults() const { return servo.device_faults | link_faults; }
  static constexpr std::int64_t kSilent_ns = 60'000'000;
};

/// Reports a servo process that ended without being asked to.
struct RunCrash {
  unsigned number = 0;
  int pid = -1;
  std::string end;  ///< "killed by signal 11 (Segmentation fault)"
  std::array<std::vector<StepTrace>, hal::kMostDevices> records;  ///< by device
};

/// One device of a run.
struct DeviceAccount {
  std::string driver;
  StatedDevice stated;
  TickCounts counts;       ///< over all servo processes; what is of the loop is that of each
  SessionVerdict verdict;  ///< over all servo processes
  LinkTimes link_times;
  hal::LinkCounters link;
  std::string trouble;
  std::string waits_for;  ///< why it was not armed at the end; empty: it was
  RunEnding ending;
  std::optional<SimulatedPeerCounters> peer;
};

struct RunAccount {
  int exit_code = 0;
  std::string scene, why;  ///< why it ended, for people
  double seconds = 0;
  std::vector<DeviceAccount> devices;
  unsigned processes = 0;
  ServoTimes times;                            ///< of the last servo process
  std::optional<hal::PageFaults> page_faults;  ///< of its loop; none where it was killed
  std::int64_t heap_grown_bytes = 0;
  std::vector<Refusal> refusals;
  bool failed_by_verdict = false;  ///< nothing else is why exit_code is not 0
  bool refused = false;            ///< in strict: nothing was armed, as the machine is not fit
  double share = 1;                ///< of force and torque, as the machine is fit for them

  /// Counts of the loop, which all devices share.
  [[nodiscard]] const TickCounts& loop() const { return devices.front().counts; }
};

/// Reports of a run while it goes on; called on the thread that runs it.
struct RunWatch {
  double status_every_s = 1.0;
  std::function<void(const RunStatus&)> status;  ///< of each device
  std::function<void(const std::vector<Refusal>&)> refusals;
  std::function<void(const RunCrash&)> crash;
  std::function<void(const std::vector<std::string>&)> notes;  ///< a line each
  std::function<void(const RunEvent&)> event;
  /// Called once the processes are forked: threads may be made.
  std::function<void()> forked;
  hal::WatcherBody watcher;       ///< GuardianSettings::watcher
  RunSession* session = nullptr;  ///< of a program that has started this run
};

/// Runs until a signal (StopSignals), the `length` asked for or the end of the servo; then ramps
/// down and closes, in order. Single-threaded until the servo processes are forked. The config's
/// drivers are used. Exit code 1 also where the time is over before the ticks are done.
[[nodiscard]] RunAccount run_device_of(const DeviceConfig& config, const SceneBytes& scene,
                                       const RunLength& length, const RunWatch& watch);

}  // namespace haptic::tools
