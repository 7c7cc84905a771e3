// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Sees every report and every output of a run on the link's thread: their times, and how the
/// output comes to its end.

#include <atomic>
#include <cstdint>
#include <span>

#include "hal/device_link.hpp"
#include "hal/realtime/histograms.hpp"
#include "hal/usb/usb_link.hpp"
#include "rt_core/safety/safety_limits.hpp"
#include "tools/run_device/servo_program.hpp"

namespace haptic::tools {

/// The last outputs, from when the end was asked for: force as handed to the device.
struct RunEnding {
  double force_n = 0;         ///< of the last output before
  std::uint64_t outputs = 0;  ///< since then
  /// Commands that differ from the one before by more than the slew limit allows in the time
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

}  // namespace haptic::tools
