// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Motions as CSV: header `t,x,y,z,qw,qx,qy,qz`, then one sample per line in s, m and a unit
/// quaternion, w first.

#include <string>
#include <vector>

#include "host_sim/session/motion_script.hpp"

namespace haptic::sim {

/// Largest | |q| - 1 | that is taken for rounding and removed by normalising.
constexpr double kMotionQuaternionTolerance = 1.0e-3;

/// A motion that is played leads no farther from W's origin [m]: farther than any workspace.
constexpr double kFarthestMotion_m = 10;

/// Reads a motion; quaternions are normalised. Lines may end in LF or CRLF, a UTF-8 byte order mark
/// and blank lines at the end are skipped. Cost: one pass, about 0.3 us per line.
/// @throws tools::InputError with file and line: unreadable or empty file, other header, too few or
///         too many numbers, a number that is malformed or not finite, time not increasing,
///         quaternion not unit.
[[nodiscard]] std::vector<MotionSample> read_motion_csv(const std::string& path);

/// The same for a motion that the core is to play, one sample in each tick of a millisecond.
/// @throws tools::InputError also for what cannot be meant so: samples less than 0.1 ms or more
/// than
///         3 ms apart, another rate on the whole than 1 kHz within 2 %, a position more than 10 m
///         from the origin (millimetres?), a jump of more than 0.5 m.
[[nodiscard]] std::vector<MotionSample> read_played_motion(const std::string& path);

/// The motion as write_motion_csv and read_motion_csv leave it: with the digits of the file.
[[nodiscard]] std::vector<MotionSample> as_written(const std::vector<MotionSample>& motion);

/// A motion with fixed digits, as write_motion_csv writes it.
[[nodiscard]] std::string motion_csv(const std::vector<MotionSample>& motion);

/// Writes a motion with fixed digits: time 6, positions 9, quaternions 12, lines ending in LF.
/// Equal samples give equal bytes.
/// @throws tools::OsError  the file cannot be written.
void write_motion_csv(const std::string& path, const std::vector<MotionSample>& motion);

}  // namespace haptic::sim
