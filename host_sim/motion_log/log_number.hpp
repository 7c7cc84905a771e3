// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Numbers of a log, as other programs write them.

#include <cstdint>
#include <optional>
#include <string_view>

namespace haptic::sim {

/// A finite number: a sign, also +, digits, a point, an exponent; with `decimal_comma` also one
/// comma before the decimals. Nothing where the text is anything else or out of range.
[[nodiscard]] std::optional<double> log_number(std::string_view text, bool decimal_comma);

/// An instant without loss: nanoseconds since 1970 do not fit into a double.
struct LogTime {
  std::int64_t whole = 0;
  double part = 0;  ///< 0 to below 1
};
/// Nothing where the text is no number or beyond 9e18.
[[nodiscard]] std::optional<LogTime> log_time(std::string_view text, bool decimal_comma);
/// From `start` to `end`, in their unit.
[[nodiscard]] double difference(const LogTime& end, const LogTime& start);

/// "nan", "inf", "-inf", "null", "none", in any case.
[[nodiscard]] bool is_not_finite_word(std::string_view text);

}  // namespace haptic::sim
