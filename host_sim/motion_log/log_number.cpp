// SPDX-License-Identifier: Apache-2.0
#include "host_sim/motion_log/log_number.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <system_error>

namespace haptic::sim {

std::optional<double> log_number(std::string_view text, bool decimal_comma) {
  if (text.starts_with('+')) {
    text.remove_prefix(1);
    if (text.starts_with('-') || text.starts_with('+')) return std::nullopt;
  }
  std::string with_point;
  if (const std::size_t comma = text.find(','); comma != std::string_view::npos) {
    if (!decimal_comma) return std::nullopt;
    with_point = text;
    with_point[comma] = '.';
    text = with_point;
  }
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [next, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || next != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<LogTime> log_time(std::string_view text, bool decimal_comma) {
  const std::string_view digits = text.starts_with('+') ? text.substr(1) : text;
  std::int64_t whole = 0;
  const char* const end = digits.data() + digits.size();
  const auto [next, error] = std::from_chars(digits.data(), end, whole);
  if (error == std::errc() && next == end) return LogTime{whole, 0};
  const bool fraction = error == std::errc() && (*next == '.' || (decimal_comma && *next == ',')) &&
                        whole >= 0 && !digits.starts_with('-') &&
                        std::all_of(next + 1, end, [](char c) { return c >= '0' && c <= '9'; });
  if (fraction && next + 1 != end) {
    // The decimals by themselves: all of a double's digits are theirs.
    const std::optional<double> part =
        log_number("0." + std::string(next + 1, static_cast<std::size_t>(end - next - 1)), false);
    if (part && *part < 1) return LogTime{whole, *part};
  }
  const std::optional<double> value = log_number(text, decimal_comma);
  if (!value || std::abs(*value) > 9e18) return std::nullopt;
  const double floor = std::floor(*value);
  return LogTime{static_cast<std::int64_t>(floor), *value - floor};
}

double difference(const LogTime& end, const LogTime& start) {
  // Both within 9.2e18: their difference may need one bit more.
  const bool negative = end.whole < start.whole;
  const auto a = static_cast<std::uint64_t>(end.whole), b = static_cast<std::uint64_t>(start.whole);
  const double whole = negative ? -static_cast<double>(b - a) : static_cast<double>(a - b);
  return whole + (end.part - start.part);
}

bool is_not_finite_word(std::string_view text) {
  static constexpr std::array<std::string_view, 10> kWords = {
      "nan", "-nan", "+nan", "inf", "-inf", "+inf", "infinity", "-infinity", "null", "none"};
  std::string word(text);
  std::transform(word.begin(), word.end(), word.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return std::find(kWords.begin(), kWords.end(), word) != kWords.end();
}

}  // namespace haptic::sim
