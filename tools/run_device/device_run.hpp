// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One run of a device: guardian, servo process and its spare, link and its thread; the state of
/// all of it while it runs, and the account at its end.

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "hal/device_link.hpp"
#include "hal/realtime/histograms.hpp"
#include "hal/usb/usb_link.hpp"
#include "tools/run_device/device_config.hpp"
#include "tools/run_device/run_events.hpp"
#include "tools/run_device/servo_program.hpp"
#include "tools/run_device/simulated_peer.hpp"

namespace haptic::tools {

// Sees every report and every output of a run on the link's thread: their times, and how the
// output comes to its end.

/// The last outputs, from when the end was asked for: force as handed to the device.
struct RunEnding {
  double force_n = 0;         ///< of the last output before
  std::uint64_t outputs = 0;  ///< since then
  /// Of them, those that differ from the one before by more than the slew limit allows in the time
  /// between; within a ramp there is none.
  std::uint64_t jumps = 0;
  double last_force_n = 0, last_torque_nm = 0;
};

/// Within the window, not over a gap of the link.
struct LinkTimes {
  hal::IntervalHistogram report_jitter;  ///< by how much two reports are not their interval apart
  hal::IntervalHistogram send_jitter;    ///< two outputs, not a period of the loop apart
  hal::IntervalHistogram answer;  ///< from a report's completion to the output that it clocked
};

/// Owner: the link's thread; results once that has ended.
class LinkWatch final : public hal::LinkObserver {
 public:
  LinkWatch(const SafetyLimits& limits, std::int64_t period_ns) noexcept
      : slew_n_per_s_(static_cast<double>(limits.slew_n_per_s)),
        period_ns_(period_ns),
        report_period_ns_(period_ns) {}

  /// From any thread: times are taken while `window` is open; it outlives the link's thread.
  void follow(const std::atomic<CountWindow>& window) noexcept {
    window_.store(&window, std::memory_order_release);
  }
  /// On the link's thread: of this connection, instead of the loop's period; 0: not known.
  void expect_reports_every(std::int64_t interval_ns) noexcept {
    report_period_ns_ = interval_ns > 0 ? interval_ns : period_ns_;
  }
  /// From any thread.
  void begin_ending() noexcept { ending_.store(true, std::memory_order_relaxed); }

  void on_report(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
                 hal::ReportVerdict verdict, std::uint64_t sequence) noexcept override;
  void on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
               const hal::GuardedOutput& output) noexcept override;
  void on_link(std::int64_t stamp_ns, LinkState state, hal::HalStatus why) noexcept override;

  // From any thread: what the device was handed last, and what the guard holds back for.
  [[nodiscard]] double force_n() const noexcept { return force_n_.load(std::memory_order_relaxed); }
  [[nodiscard]] double torque_nm() const noexcept {
    return torque_nm_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint32_t faults() const noexcept {
    return faults_.load(std::memory_order_relaxed);
  }

  [[nodiscard]] const RunEnding& ending() const noexcept { return end_; }
  [[nodiscard]] const LinkTimes& times() const noexcept { return times_; }

 private:
  [[nodiscard]] bool is_open() const noexcept;
  void note_output(std::int64_t stamp_ns, const hal::GuardedOutput& output) noexcept;
  static void add_step(std::int64_t stamp_ns, std::int64_t period_ns, std::int64_t& last_ns,
                       hal::IntervalHistogram& jitter) noexcept;

  double slew_n_per_s_;
  std::int64_t period_ns_, report_period_ns_;
  std::atomic<const std::atomic<CountWindow>*> window_{nullptr};
  std::atomic<bool> ending_{false};
  std::atomic<double> force_n_{0}, torque_nm_{0};
  std::atomic<std::uint32_t> faults_{0};
  std::int64_t report_ns_ = 0, send_ns_ = 0, unanswered_ns_ = 0;  ///< 0: none yet
  Vec3 force_d_ = Vec3::Zero();
  std::int64_t output_ns_ = 0;
  RunEnding end_;
  LinkTimes times_;
};

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

/// For people who watch: what the device is handed is told by its link, not by who asked for it.
struct RunStatus {
  double t_s = 0;                     ///< since the device is held
  double force_n = 0, torque_nm = 0;  ///< handed to the device last
  std::uint32_t link_faults = 0;      ///< DeviceFault, for which the guard holds back
  std::int64_t silence_ns = 0;        ///< since the servo process ticked last
  ServoStatus servo;                  ///< its last word
  LinkState link = LinkState::kAbsent;
  hal::LinkCounters counters;
  std::string trouble;  ///< of the link; empty: none

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
  std::vector<StepTrace> records;
};

struct RunAccount {
  int exit_code = 0;
  std::string driver, scene, why;  ///< why it ended, for people
  double seconds = 0;
  TickCounts counts;  ///< over all servo processes
  unsigned processes = 0;
  ServoTimes times;  ///< of the last servo process
  LinkTimes link_times;
  std::optional<hal::PageFaults> page_faults;  ///< of its loop; none where it was killed
  std::int64_t heap_grown_bytes = 0;
  hal::LinkCounters link;
  std::string trouble;
  RunEnding ending;
  std::optional<SimulatedPeerCounters> peer;
  std::vector<Refusal> refusals;
  bool refused = false;  ///< in strict: nothing was armed, as the machine is not fit
  double share = 1;      ///< of force and torque, as the machine is fit for them
};

/// What a run reports while it goes on; called on the thread that runs it.
struct RunWatch {
  double status_every_s = 1.0;
  std::function<void(const RunStatus&)> status;
  std::function<void(const std::vector<Refusal>&)> refusals;
  std::function<void(const RunCrash&)> crash;
  std::function<void(const std::vector<std::string>&)> notes;  ///< a line each
  std::function<void(const RunEvent&)> event;
  /// Called once the processes are forked: threads may be made.
  std::function<void()> forked;
};

/// Runs until a signal (StopSignals), the `length` asked for or the end of the servo; then ramps
/// down and closes, in order. Single-threaded until the servo processes are forked. The config's
/// driver is used. Exit code 1 also where the time is over before the ticks are done.
[[nodiscard]] RunAccount run_device_of(const DeviceConfig& config, const SceneBytes& scene,
                                       const RunLength& length, const RunWatch& watch);

}  // namespace haptic::tools
