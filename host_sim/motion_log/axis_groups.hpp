// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Columns of a log that belong together: the same name but for x, y, z or w, or for a number.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host_sim/motion_log/column_name.hpp"

namespace haptic::sim {

inline constexpr std::string_view kPlaceAxes = "xyz", kTurnAxes = "wxyz";

/// Columns of one stem by axis.
struct AxisGroup {
  std::string stem;
  int rank = 0;
  std::vector<std::size_t> columns;  ///< x, y, z or w, x, y, z; of numbered ones in their order
  bool numbered = false, twice = false;
};

/// Groups of `names` with all of `axes`, or numbered from 0 to as many, the likeliest first.
[[nodiscard]] std::vector<AxisGroup> axis_groups(std::span<const ColumnName> names,
                                                 std::string_view axes,
                                                 std::optional<int> (*rank_of)(std::string_view));

/// The text before "position" or "orientation": a pose has both.
[[nodiscard]] std::string owner_of(std::string stem);

}  // namespace haptic::sim
