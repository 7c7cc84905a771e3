// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Scripted hand motions: way points in a TOML file, joined by minimum-jerk segments, with a seeded
/// tremor on top. The same script and seed give the same samples, bit for bit, with every compiler
/// (for one choice of HAPTIC_REAL: the rotations go through rt_core's own functions). The file
/// format is described in MOTION.md of this folder. All poses are of the moving part's frame A in
/// the workspace W: p_wa [m], q_wa unit.

#include <cstdint>
#include <string>
#include <vector>

namespace haptic::sim {

/// The commanded pose of the moving part at one instant.
struct MotionSample {
  double t_s = 0.0;
  double p[3] = {0.0, 0.0, 0.0};            ///< [m]
  double q_wxyz[4] = {1.0, 0.0, 0.0, 0.0};  ///< unit, w first
};

/// A pose to be reached at `t_s`, at rest.
struct WayPoint {
  std::string phase = "motion";  ///< name of the segment that ends here
  double t_s = 0.0;
  double p[3] = {0.0, 0.0, 0.0};            ///< [m]
  double q_wxyz[4] = {1.0, 0.0, 0.0, 0.0};  ///< unit
  double tremor = 1.0;  ///< factor of the tremor here, blended along the segments; 0 to 1
};

/// Tremor of the hand. Each of the three displacements and three rotations is the mean of three
/// sines whose frequencies and phases are drawn from the seed.
struct Tremor {
  double position_m = 0.0;  ///< no axis moves by more than this
  double angle_rad = 0.0;   ///< no rotation component exceeds this (W axes, about A's origin)
  double band_hz[2] = {8.0, 12.0};  ///< range of the frequencies
};

/// A command to the hand at a time, in a scene with parts.
struct HoldCommand {
  double t_s = 0.0;
  std::string part;  ///< to be held from then on; empty: let go of what is held
};

struct MotionScript {
  double rate_hz = 1000.0;
  std::uint64_t seed = 0;
  Tremor tremor;
  std::vector<WayPoint> waypoints;  ///< at least two, times strictly increasing
  std::vector<HoldCommand> holds;   ///< in their order
};

/// Reads a script.
/// @throws tools::UsageError where the name is that of a motion, a log or a compiled scene.
/// @throws tools::InputError with file and line: unreadable file, TOML syntax, unknown or missing
///         key, value out of range, times not increasing, a turn of more than 3 rad within one
///         segment.
[[nodiscard]] MotionScript read_motion_script(const std::string& path);

/// The motion from the first way point to the last at `rate_hz`, both ends included when the
/// duration is a multiple of the period. `script` must satisfy what read_motion_script checks.
/// Cost: linear in the samples.
[[nodiscard]] std::vector<MotionSample> make_motion(const MotionScript& script);

/// Name of the segment that holds time `t_s` (the first before it, the last after it).
[[nodiscard]] const std::string& phase_at(const MotionScript& script, double t_s);

}  // namespace haptic::sim
