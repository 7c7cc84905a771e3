// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The motion that a log of another program holds: samples at the log's own times, in s, m and unit
/// quaternions. Which columns, separators and units are known: host_sim/COMMANDS.md.

#include <cstddef>
#include <string>
#include <vector>

#include "host_sim/motion_log/log_columns.hpp"
#include "host_sim/motion_log/log_options.hpp"
#include "host_sim/session/motion_script.hpp"

namespace haptic::sim {

/// Largest | |q| - 1 | of a log that is taken for rounding: numbers of two decimals.
inline constexpr double kLogQuaternionTolerance = 1e-2;

struct MotionLog {
  std::vector<MotionSample> samples;  ///< time from 0; q and its neighbours on one side
  std::vector<std::size_t> lines;     ///< of the samples in the file
  std::string path, form, clock;
  LogColumns columns;
  std::size_t normalised = 0;  ///< quaternions off 1 by more than 1e-6
  double worst_length = 1;     ///< of them the farthest from 1
  std::size_t turned = 0;      ///< of the other sign than the sample before
};

/// @throws tools::InputError with the file, the line of a bad row and the fix: no such columns, a
///         number that is missing or not finite, a quaternion that is none, times that repeat or
///         run backwards, fewer than two samples.
[[nodiscard]] MotionLog read_motion_log(const LogOptions& options);

}  // namespace haptic::sim
