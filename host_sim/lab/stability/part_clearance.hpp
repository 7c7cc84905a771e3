// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Part 6 of the stability report: a square peg in a hole of five pieces, clearance from 1 mm down
/// to 10 um, with and without friction.

#include <cstdint>

#include "host_sim/report/part_report.hpp"
#include "rt_core/base/scalar.hpp"

namespace haptic::sim {

/// Stated limits. The peg reaches the floor in the swaying insertion; pressed sideways it stands
/// off the wall by nothing, so its way is the clearance; tilted and pushed it follows without
/// friction and else lags by what sliding on two points holds. Largest steps of force and torque
/// halve with the step, but where the swaying peg sticks and slips: such a slip releases at most a
/// share of what friction held.
struct ClearanceLimits {
  double offset_m = 1e-6;
  double floor_m = 1e-6;         ///< of the peg's lowest corner over the floor
  double free_lag_m = 1e-4;      ///< without friction
  double friction_share = 0.02;  ///< of the force that sliding on two points gives
  double least_ratio = 1.5;      ///< of the largest steps when the step is halved
  double slip_share = 0.25;      ///< largest force step over friction times largest wall force
  /// Smaller steps need not halve: k_t, or k_r over 5 mm, times twice the depth that counts as
  /// free, which in single precision is 0.7 um.
  double still_force_n = HAPTIC_REAL_IS_FLOAT ? 2e-3 : 1e-3;
  double still_torque_nm = HAPTIC_REAL_IS_FLOAT ? 3e-4 : 1e-5;
};

/// Files clearance.{csv,md,svg}. `quick`: widest and narrowest clearance, no and most friction.
[[nodiscard]] PartReport clearance_part(bool quick, const ClearanceLimits& limits = {});

}  // namespace haptic::sim
