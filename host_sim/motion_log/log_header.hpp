// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The names of a log's columns where a header has several lines, as trackers export: what was
/// recorded, then the bodies, then their axes, perhaps units below.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host_sim/motion_log/log_rows.hpp"

namespace haptic::sim {

/// Most lines before the first row of numbers that are looked at.
inline constexpr std::size_t kMostHeaderLines = 16;

struct LogHeader {
  std::size_t line = 0;  ///< the one with the names, of those that were given
  std::vector<std::string> names;
  std::string length_unit;  ///< that a line above states for all lengths; empty: none
};

/// The first line that holds a pose; x, y, z, w alone have before them what stands above ("Position
/// X"), as many lines as make them a pose and tell them apart. Where none does, the line with the
/// most names. `lines`: cells of those before the first row of numbers, one at least.
[[nodiscard]] LogHeader header_among(std::span<const std::vector<std::string>> lines,
                                     HoldsPose holds_pose);

/// True if a line below the names holds units alone, as "s" below a time and "mm" below places.
[[nodiscard]] bool is_unit_row(std::span<const std::string_view> cells);

/// Puts the units of such a line behind the names that state none: "x [mm]".
void add_units(std::span<const std::string_view> cells, std::vector<std::string>& names);

}  // namespace haptic::sim
