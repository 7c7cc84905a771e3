// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The meaning of the name of one column of a log.

#include <optional>
#include <string>
#include <string_view>

namespace haptic::sim {

/// "pose.position.x_mm", "PositionX (mm)" and "pose/position/x [mm]" are all: stem
/// "poseposition", axis 'x', unit "mm".
struct ColumnName {
  std::string whole;  ///< lower case, letters and digits alone, without a unit in brackets
  std::string unit;   ///< as the file has it, in brackets or behind the name; empty: none
  std::string stem;   ///< without axis and unit
  char axis = 0;      ///< 'x', 'y', 'z', 'w', '0' to '9'; 0: none
};
[[nodiscard]] ColumnName column_name(std::string_view name);

/// Metres, or seconds, in a unit by its name. Nothing where it is not known.
[[nodiscard]] std::optional<double> length_unit_m(std::string_view unit);
[[nodiscard]] std::optional<double> time_unit_s(std::string_view unit);

/// How likely a stem is that of positions, of quaternions; 0: most likely. Nothing: it is not.
[[nodiscard]] std::optional<int> position_rank(std::string_view stem);
[[nodiscard]] std::optional<int> quaternion_rank(std::string_view stem);
/// The same of a column of times, by its whole name; takes a unit from its end.
struct TimeName {
  int rank = 0;
  std::string unit;
};
[[nodiscard]] std::optional<TimeName> time_name(const ColumnName& name);

}  // namespace haptic::sim
