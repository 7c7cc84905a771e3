// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A whole run of the device stack along a hand motion: the reference device with the hand on it,
/// its protocol, the link, the guard and the servo tick. Its CSV, its picture and its account.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "host_sim/device/device_stack.hpp"
#include "host_sim/device/loop_run.hpp"

namespace haptic::sim {

/// Report rates that the reference device can have [Hz].
inline constexpr double kLeastReportRate_hz = 50, kMostReportRate_hz = 10000;
/// The deadman is held from the one after the begin until the other before the end.
inline constexpr double kDeadmanAfter_s = 0.1, kDeadmanBefore_s = 0.1;

/// Settings of a stack over a device of this model: its limits are those of the device (the
/// reference device's where neither says otherwise), `given` adds the rates of force and torque.
/// @param rate_hz  reports per second, kLeastReportRate_hz to kMostReportRate_hz
[[nodiscard]] StackSettings stack_over(StackCarrier carrier, const DeviceModel& device,
                                       const DeviceParameters& given, const HandModel& hand,
                                       double rate_hz);

/// The hand along a motion that has the device's rate, resting at its end, with the deadman. D is
/// W; `number` of the hand.
[[nodiscard]] std::function<HandAction(double t_s)> scripted_hand(const CoreSession& session,
                                                                  std::vector<MotionSample> motion,
                                                                  double rate_hz,
                                                                  std::uint32_t number = 0);

/// The values of every period of the device that a run keeps.
struct StackRecord {
  LoopRecord loop;  ///< wrench as rendered, before the safety stages; device: as the core got it
  ArmingState arming = ArmingState::kDisarmed;
  std::uint32_t faults = 0;         ///< SafetyFault, latched
  std::uint32_t device_faults = 0;  ///< DeviceFault, of the state that the tick saw
  LinkState link = LinkState::kAbsent;
  bool drives_on = false;
  bool rendered_new = false;  ///< the core has ticked; else its last result is there again
  Wrench handed_d;            ///< in the newest command that was handed to the bus
  Load acting_w;              ///< on the handle in this period
  std::uint64_t sends = 0;
  std::uint32_t armings = 0, cuts = 0;  ///< so far; by the operator, and by the device's watchdog
};

/// One record per sample of `motion` after the first, which the device starts at. `before_step` is
/// called before each with its time, `after_step` after each. Cost: the ticks.
[[nodiscard]] std::vector<StackRecord> run_stack(
    DeviceStack& stack, std::span<const MotionSample> motion,
    const std::function<void(const StackRecord&)>& after_step = {},
    const std::function<void(double t_s)>& before_step = {});

/// Both devices of a stack, along motions of one length.
[[nodiscard]] Hands::Each<std::vector<StackRecord>> run_stacks(
    DeviceStack& stack, const Hands::Each<std::span<const MotionSample>>& motions,
    const std::function<void(const Hands::Each<StackRecord>&)>& after_step = {},
    const std::function<void(double t_s)>& before_step = {});

/// The columns of loop_csv, then arming, faults, link and the wrenches behind the rendering, then
/// those of the guide where there is one; LF.
[[nodiscard]] std::string stack_csv(std::span<const StackRecord> records,
                                    const GuideLegs& legs = {});

struct StackTotals {
  LoopTotals loop;
  std::uint64_t sends = 0;
  std::uint32_t armings = 0, cuts = 0;
  std::uint32_t faults = 0, device_faults = 0;  ///< ever
  double first_fault_at_s = 0;                  ///< of `faults`; 0 without any
  double largest_handed_n = 0, largest_handed_nm = 0;
  /// Between two periods in which the bus was there; what the device keeps when it goes away is not
  /// a step that it was handed.
  double largest_handed_step_n = 0, largest_handed_step_nm = 0;
  double handed_step_at_s = 0;  ///< of the force
  bool ended_ready = false;     ///< link, in the last period
  bool ended_at_zero = false;   ///< the last wrench handed over
};
[[nodiscard]] StackTotals total(std::span<const StackRecord> records);

// Picture of a run of the device stack: what was rendered, what was handed to the bus and what
// acted on the handle, with depth, arming and link below.

/// A complete SVG document; size and reduction as replay_plot. `title` may hold any text.
/// Deterministic.
[[nodiscard]] std::string stack_plot(std::span<const StackRecord> records, const std::string& title,
                                     double exact_band_m);

}  // namespace haptic::sim
