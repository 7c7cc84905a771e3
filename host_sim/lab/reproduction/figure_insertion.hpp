// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Fig. 6 of the paper: a peg and a hole of five convex pieces, in physical space and in C-space.

#include <array>
#include <vector>

#include "host_sim/session/motion_script.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// Hole of the pictures: wide enough for the channel in C-space to be seen.
inline constexpr double kPictureHoleHalf_m = 0.014;

/// The insertion at 1 kHz: over the hole, tilted at the rim, along a wall, on the floor.
[[nodiscard]] std::vector<MotionSample> insertion_motion(double half_width_m);

[[nodiscard]] PartReport insertion_part();

}  // namespace haptic::sim
