// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Statements of a person about a log beyond its columns.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace haptic::sim {

/// In which the four numbers of a quaternion stand.
enum class QuaternionOrder : std::uint8_t { kXyzw, kWxyz };

struct LogOptions {
  std::string path;
  /// Names of all columns in their order, or pairs "x=tcp_x"; empty: as the file has them.
  std::vector<std::string> columns;
  std::string key;  ///< JSON: the array that holds x, y, z and a quaternion
  std::optional<QuaternionOrder> order;
  std::optional<double> unit_m;       ///< of the positions
  std::optional<double> time_unit_s;  ///< of the times
  std::optional<double> rows_hz;      ///< a log without times: its rate
};

/// "xyzw" or "wxyz".
[[nodiscard]] inline const char* order_text(QuaternionOrder order) {
  return order == QuaternionOrder::kXyzw ? "xyzw" : "wxyz";
}

}  // namespace haptic::sim
