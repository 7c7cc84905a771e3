// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The last stage before the bus, owned by the USB thread: it does not trust the servo thread. It
/// keeps its own copy of the last wrench sent, answers an old command by a decay and then a ramp to
/// zero, and stays at zero until the operator arms again.
///
/// Letting go is the slew alone, from the wrench sent last: its target is zero, so that no
/// component grows, no matter what is commanded meanwhile.

#include <cstdint>

#include "hal/device.hpp"
#include "rt_core/safety/safety_limits.hpp"
#include "rt_core/safety/wrench_ramp.hpp"

namespace haptic::hal {

struct GuardedOutput {
  Wrench wrench_d;
  std::uint64_t tick = 0;     ///< of the command that it rests on
  std::uint32_t faults = 0;   ///< DeviceFault, upper half: latched here
  std::uint32_t present = 0;  ///< those of them whose cause is there now
  bool held = false;          ///< the last wrench was held and faded
};

class OutputGuard {
 public:
  explicit OutputGuard(const SafetyLimits& limits) noexcept;

  /// The command to send now. `command` is the newest there is; its age is now_ns -
  /// command.stamp_ns. Not finite: it counts as not received, and the age is that of the last one
  /// that was. Beyond the limits or faster than the slew limit: cut to them. One period of age is
  /// allowed; older than the limits' held_periods beyond it, or stamped farther in the future than
  /// that: held and decaying; older than lost_periods: ramp to zero, kLinkStaleCommand latched
  /// until command.arming grows. A tick number that goes back means another servo process:
  /// kLinkServoLost. The result differs from the last one by at most slew times the time since, of
  /// which longest_step_s counts. Cost: constant.
  [[nodiscard]] GuardedOutput update(std::int64_t now_ns, const DeviceCommand& command) noexcept;

  /// How often the device reports, and so is sent to; 0: not known. The shorter of this and the
  /// loop's period is the one of longest_step_s.
  void follow_reports(std::int64_t period_ns) noexcept { report_period_ns_ = period_ns; }

  /// Reports that the driver rounded or withheld part of the last output. The next output starts
  /// from what was delivered, so that the withheld part does not come back in one step.
  void delivered(const Wrench& delivered_d) noexcept {
    if (is_finite(delivered_d)) output_.sent_d = delivered_d;
  }

  /// The last output did not reach the device: the next one starts from what was sent before it.
  void not_delivered() noexcept { output_ = before_; }

  /// The output before the last one is sent again in its place, now: the next one is one step from
  /// it.
  void stay() noexcept {
    const std::int64_t stamp_ns = output_.stamp_ns;
    output_ = before_;
    output_.stamp_ns = stamp_ns;
    output_.stamped = true;
  }

  /// True: the last output is farther from `device_d`, what the device has by its own word, than
  /// one output may step, and farther than the output before it. A device that has missed those in
  /// between would be handed all of it at once.
  [[nodiscard]] bool runs_ahead_of(const Wrench& device_d) const noexcept;

  /// Latches a fault from outside (link lost, servo process ended): ramps to zero. Without a fault:
  /// ramps to zero alone.
  void latch(std::uint32_t faults) noexcept;

  /// Ramps to zero until the arming count grows beyond that of `newest`: the device can not be
  /// driven now, no matter what the servo thread assumes.
  void hold_back(const DeviceCommand& newest) noexcept;

  /// Bounds of this connection in addition to those it was made with, the tighter of each; with
  /// restart(), since what was sent was another device's.
  void limit(const SafetyLimits& connection) noexcept;

  /// After the device was away: what is sent first is exactly zero, and stays so until
  /// command.arming grows beyond what it is now.
  void restart() noexcept;

  [[nodiscard]] std::uint32_t faults() const noexcept { return faults_; }
  [[nodiscard]] const Wrench& last() const noexcept { return output_.sent_d; }

 private:
  /// Members that an output changes and not_delivered() restores.
  struct Output {
    WrenchRamp ramp;
    Wrench sent_d;
    std::int64_t stamp_ns = 0;
    bool stamped = false;
  };

  void follow_arming(const DeviceCommand& command) noexcept;
  [[nodiscard]] std::int64_t period_of_sends_ns() const noexcept;
  [[nodiscard]] std::uint64_t command_age_ns(std::int64_t now_ns,
                                             const DeviceCommand& command) noexcept;

  SafetyLimits own_, limits_;  ///< as made; in force
  Output output_, before_;
  std::int64_t report_period_ns_ = 0;
  std::uint32_t faults_ = 0;
  std::uint64_t tick_ = 0;            ///< the newest seen
  std::int64_t finite_stamp_ns_ = 0;  ///< of the newest command that was finite
  bool finite_seen_ = false;
  std::uint32_t arming_ = 0;      ///< the newest seen
  std::uint32_t blocked_at_ = 0;  ///< arming count at which output stays zero, where blocked_
  bool blocked_ = true;
};

}  // namespace haptic::hal
