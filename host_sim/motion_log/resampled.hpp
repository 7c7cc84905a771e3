// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A motion at an even rate, and in another place.

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "host_sim/session/motion_script.hpp"

namespace haptic::sim {

/// Longest motion that is made: an hour at 1 kHz, and more.
inline constexpr std::size_t kMostResampled = 10'000'000;

/// How many samples resampled() makes; as a double, since it may be any number.
[[nodiscard]] double resampled_count(std::span<const MotionSample> motion, double rate_hz);

/// The motion at t = 0, 1/rate, 2/rate .. up to its end, of times from 0. Between two samples the
/// place is linear in time and the turn goes the shorter way at an even speed (spherical linear):
/// through every sample, and never beyond two neighbours, so no part is pushed farther than the log
/// says. The speed changes at the samples of the log, the place does not jump.
[[nodiscard]] std::vector<MotionSample> resampled(std::span<const MotionSample> motion,
                                                  double rate_hz);

/// A turn, then a way, of W.
struct Placement {
  std::array<double, 4> q_wxyz = {1, 0, 0, 0};  ///< unit
  std::array<double, 3> p_m = {0, 0, 0};
};
void place(std::vector<MotionSample>& motion, const Placement& placement);

/// The placement that makes `from` to `to`.
[[nodiscard]] Placement placement_between(const MotionSample& from, const MotionSample& to);

/// Angle between the orientations of two samples [rad].
[[nodiscard]] double turn_between(const MotionSample& a, const MotionSample& b);

}  // namespace haptic::sim
