// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Times of a log: their unit, and that they increase.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "host_sim/motion_log/log_columns.hpp"
#include "host_sim/motion_log/log_number.hpp"

namespace haptic::sim {

struct LogClock {
  std::vector<double> t_s;  ///< from the first sample
  std::string text;  ///< "nanoseconds since 1970 by their size", "s by the name of the column"
};

/// The unit is that of --time-unit, of the column's name, or goes by the size of an instant since
/// 1970; else seconds. `lines`: of the times in the file.
/// @throws tools::InputError  a time that repeats or runs backwards, by line; samples that are on
///         the whole less than 20 us or more than 0.5 s apart in a unit that nobody told.
[[nodiscard]] LogClock clock_of(const std::string& path, std::span<const LogTime> times,
                                std::span<const std::size_t> lines, const LogColumns& columns,
                                const LogOptions& options);

}  // namespace haptic::sim
