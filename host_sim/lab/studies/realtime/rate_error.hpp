// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the number of passes of the proxy costs in error at a rate: the wrench of a scene along a
/// motion of its part, against that of twenty passes in quarter steps of the same motion.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/session/motion_script.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic::sim {

/// One rate with one number of passes. Errors: length of the difference of force and of torque from
/// the reference at the same times, over the ticks in which the reference has a force and neither
/// is bringing a part out of an obstacle (kFlagRecovery).
struct RateError {
  double rate_hz = 0;
  std::uint32_t passes = 0;
  std::uint64_t ticks = 0, contact_ticks = 0;
  double median_force_error_n = 0, p99_force_error_n = 0, max_force_error_n = 0;
  double p99_torque_error_nm = 0, max_torque_error_nm = 0;
  double largest_force_n = 0, largest_torque_nm = 0;  ///< of the reference
  double p99_tick_ns = 0;  ///< the least of five runs of each tick counts
};

/// At each rate the scene's own passes, and one pass where those are more. `motion`: of the part;
/// its rate is not used. The scene's rate is replaced by the one asked for, all else stays. Cost:
/// (4 x 20 + 5 x passes) passes a tick. @throws tools::InputError  the scene has no passes (law),
/// or a pose is refused.
[[nodiscard]] std::vector<RateError> rate_errors(const SceneView& view, const MotionScript& motion,
                                                 std::span<const double> rates_hz);

}  // namespace haptic::sim
