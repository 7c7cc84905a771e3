// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Checks whether scene, workspace map and loop fit the device that is connected, by what it states
/// of itself; and how much force a loop may still exert that the machine does not serve in time.

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "hal/device.hpp"
#include "hal/realtime/wakeup_measurement.hpp"
#include "rt_core/safety/safety_limits.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic::tools {

/// Demands on a device, apart from the device.
struct FitQuestion {
  SceneParameters scene{};
  double radius_m = 0;  ///< r_A: of the moving part about its grip
  double scale = 1;     ///< [workspace] scale
  std::int64_t loop_period_ns = 1'000'000;
  bool report_clocked = false;
  bool accept_unbudgeted = false;
  /// Periods that a tick may take while another device, whose reports clock the loop, is away.
  double longest_tick = 1;
};

[[nodiscard]] FitQuestion fit_question(const SceneView& scene, double scale,
                                       std::int64_t loop_period_ns, bool report_clocked,
                                       bool accept_unbudgeted);

struct FitAnswer {
  std::string refusal;             ///< why it may not be driven, numbers and fix; empty: it may
  std::vector<std::string> notes;  ///< what a person should know all the same, a line each
};

/// The device feels the scene's stiffness and damping times scale^2 (F_d = s F_w, x_w = s x_d).
/// - Stiffest contact state and damping beyond what the device states: refused.
/// - Passivity budget against the connected device, in the loop's own time: sampled every loop or
///   report period, the longer, as many times that as a tick may take; delayed by one of them (half
///   of one if clocked by reports) and the latency that the device states, or by the scene's
///   delay_s, the longer. Mass and damping are the
///   device's; what it does not state is taken from the scene's [device]. Turns count where it
///   drives them. Beyond the budget, or no mass known: refused, unless accept_unbudgeted or the
///   scene's own allow_active.
/// - Clocked by reports, the loop asks for more of them than the device delivers: refused. Reports
///   come as often as the device states and the bus looks for them (bInterval), the slower of the
///   two.
/// - A scene budgeted for another device says so; so does a part of the scene's workspace that the
///   device does not reach, a scene compiled for more reports than the device delivers, reports
///   slower than the loop, and a loop at another rate than the scene's.
/// A device without motors fits. Cost: below some milliseconds; allocates.
[[nodiscard]] FitAnswer fit_of(const FitQuestion& question, const hal::DeviceCapabilities& device);

/// fit_of at each connection of a link (LinkSettings::accept), and what people are informed of, the
/// limits in force among it. All members from any thread; none is called while reports flow.
class DeviceGate {
 public:
  /// `limits`: of driver, configuration and machine. `share`: of what the device states.
  DeviceGate(const FitQuestion& question, const SafetyLimits& limits, Real share = 1)
      : question_(question), limits_(limits), share_(share) {}
  /// @return the refusal.
  [[nodiscard]] std::string admit(const hal::DeviceCapabilities& device);
  /// Refusal of the newest connection.
  [[nodiscard]] std::string refusal() const;
  /// Notes that differ from those of the connection before; each set once.
  [[nodiscard]] std::vector<std::string> take_notes();

 private:
  const FitQuestion question_;
  const SafetyLimits limits_;
  const Real share_;
  mutable std::mutex mutex_;
  std::string refusal_;
  std::vector<std::string> told_, untold_;
};

/// Grants of the machine to a loop on a device with motors.
struct MachineFit {
  bool fit = true;
  double share = 1;   ///< of force and torque that a degraded loop may exert
  std::string found;  ///< the wake-ups, for people
};

/// Fit: everything asked for was granted, and no wake-up measured came later than a quarter of the
/// period (as `doctor --strict` has it). Else the share is a half, or less: a wrench may be held
/// for as long as the latest wake-up, so that share times that time is at most a period.
[[nodiscard]] MachineFit machine_fit(const hal::WakeupMeasurement& wakeups, std::int64_t period_ns,
                                     bool all_granted);

/// `limits` with force and torque, norms and axes, times `share`.
[[nodiscard]] SafetyLimits lowered(const SafetyLimits& limits, double share) noexcept;

}  // namespace haptic::tools
