// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which columns of a log are time, position and quaternion.

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "host_sim/motion_log/log_options.hpp"
#include "host_sim/motion_log/log_rows.hpp"

namespace haptic::sim {

inline constexpr std::size_t kNoColumn = static_cast<std::size_t>(-1);

struct LogColumns {
  std::size_t time = kNoColumn;         ///< kNoColumn: the rows are counted
  std::size_t nanoseconds = kNoColumn;  ///< beside whole seconds in `time`
  std::optional<double> time_unit_s;    ///< as the name says
  std::array<std::size_t, 3> position{};
  double unit_m = 1;
  bool unit_told = false;  ///< by a name or an option, not assumed
  std::array<std::size_t, 4> quaternion_wxyz{};
  /// In which the four stand in the file; nothing where they are mixed.
  std::optional<QuaternionOrder> order;
  /// For a person: names as in the file, or "column 5".
  std::string time_text, position_text, quaternion_text;

  std::size_t row_cells = 0;  ///< where the file has no names: in every row

  [[nodiscard]] std::size_t count() const;  ///< a row has so many at least
};

/// @throws tools::InputError  naming what is missing or double, the columns that there are, and the
///         option that tells.
[[nodiscard]] LogColumns find_columns(const LogRows& log, const LogOptions& options);

/// True if a position and a quaternion are among `names`.
[[nodiscard]] bool holds_pose(std::span<const std::string> names);

}  // namespace haptic::sim
