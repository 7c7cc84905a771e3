// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The script of a cell of the fault matrix, on any stage: the state is reached, the fault
/// comes, its cause goes, and the operator takes force again.

#include <cstddef>

#include "hal/drivers/reference_codec.hpp"
#include "host_sim/lab/faults/fault_stage.hpp"

namespace haptic::sim {

/// Watched from the fault on, before anything is repaired [periods].
inline constexpr std::size_t kFaultWatch = 300;
/// Height of the handle's point in D where the part touches, z upwards, the wall below.
inline constexpr double kTouchHeight_m = 0.010 + 0.050;
/// How far the hand goes sideways (y) and may, and how far it may turn.
inline constexpr double kBoxHalfWidth_m = 0.02, kLargestAngle_rad = 0.3;

/// What FaultCause::kOtherDevice plugs in: 5 N and 500 N/s.
[[nodiscard]] hal::ReferenceBlock weaker_block();

/// The hand where a script begins: off the wall, at rest, without switches.
[[nodiscard]] HandPlan hand_at_start();

/// From there, with nothing wrong and the device plugged in. @throws tools::InputError  the state
/// is not reached.
[[nodiscard]] FaultTrace play_fault(FaultStage& stage, const FaultCase& cell);

/// Back to where a script may begin, after `cell` or after force without one. An encoder that
/// jumped counts right only from power-up on; a map that the clutch has moved is as it was only in
/// another servo process.
void rest_after(FaultStage& stage, const FaultCase& cell);
/// The operator takes force on the wall, lightly, and keeps it.
void take_force(FaultStage& stage);

}  // namespace haptic::sim
