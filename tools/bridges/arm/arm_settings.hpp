// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The keys of `[device]` that every bridge to an arm has, and what they stand for.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "hal/drivers/driver_registry.hpp"
#include "tools/bridges/arm/arm_description.hpp"

namespace haptic::tools {

/// Servos of both makes count 4096 steps a turn.
inline constexpr double kCountsPerTurn = 4096;
inline constexpr double kTurn_rad = 6.283185307179586;
inline constexpr double kCountStep_rad = kTurn_rad / kCountsPerTurn;

/// A servo that the hand pulls, as a switch.
struct TriggerSettings {
  bool present = false;
  std::uint8_t id = 0;
  double open_rad = 0, closed_rad = 0;  ///< of the servo, as its counts say
};

struct ArmSettings {
  std::string port;
  std::uint32_t baud = 1'000'000;
  std::vector<std::uint8_t> ids;  ///< one a joint, from the base to the handle
  ArmDescription arm;             ///< with D placed
  JointNumbers offsets_rad{};     ///< of the servo where the joint is at 0
  JointNumbers signs{};           ///< +1 or -1: a joint turns with its servo or against it
  TriggerSettings trigger;
};

/// Reads `port`, `baud`, `ids`, `urdf`, `base_link`, `tip_link`, `offsets_rad`, `signs`,
/// `base_rpy_deg`, `origin_m`, `trigger_id`, `trigger_rad`. @return false with `defect` filled.
[[nodiscard]] bool read_arm_settings(const hal::DriverOptions& options, ArmSettings& settings,
                                     hal::DriverDefect& defect);

/// The numbers of a key's text, separated by blanks or commas: `count` of them, each finite and
/// from `least` to `most`. Unchanged where the key is absent. False with `defect` filled.
[[nodiscard]] bool read_numbers(const hal::DriverOptions& options, std::string_view key,
                                std::size_t count, double least, double most,
                                std::vector<double>& numbers, hal::DriverDefect& defect);

/// The same into the first `count` of `numbers`.
[[nodiscard]] bool read_joint_numbers(const hal::DriverOptions& options, std::string_view key,
                                      std::size_t count, double least, double most,
                                      JointNumbers& numbers, hal::DriverDefect& defect);

/// Angle of joint k for a servo's counts, with `turns_rad` from nearest_turns.
[[nodiscard]] inline double joint_angle(const ArmSettings& settings, std::size_t k, double counts,
                                        const JointNumbers& turns_rad) noexcept {
  return settings.signs[k] * (counts * kCountStep_rad - settings.offsets_rad[k]) + turns_rad[k];
}

/// After power-up a servo counts within one turn, whichever its joint stands in: the whole turns to
/// add, so that each angle is the one nearest to the middle of its limits.
[[nodiscard]] JointNumbers nearest_turns(const ArmModel& model, const JointNumbers& angles_rad);

/// A sentence about the first joint that is outside its limits by more than 0.2 rad, which is a
/// wrong offset or sign; empty: none is.
[[nodiscard]] std::string outside_limits(const ArmSettings& settings,
                                         const JointNumbers& angles_rad);

/// True where a trigger at `servo_rad` counts as pulled: from 60 % of its way on, and until it is
/// back at 40 %.
[[nodiscard]] bool is_pulled(const TriggerSettings& trigger, double servo_rad,
                             bool was_pulled) noexcept;

}  // namespace haptic::tools
