// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Text from numbers by a printf format; the compiler checks the arguments against it.

#include <cstdint>
#include <string>

namespace haptic::tools {

/// The text that printf would write, of any length.
[[nodiscard, gnu::format(printf, 1, 2)]] std::string formatted(const char* format, ...);

/// Appends the same and the end of a line.
[[gnu::format(printf, 2, 3)]] void append_line(std::string& text, const char* format, ...);

/// 0 for -0, else the number itself.
[[nodiscard]] constexpr double unsigned_zero(double number) { return number == 0 ? 0.0 : number; }
/// A text of a number that is zero as it is shown loses its sign: "-0.00" is "0.00".
[[nodiscard]] std::string unsigned_zero(std::string shown);

/// `value` to `digits` significant digits (%g).
[[nodiscard]] std::string short_number(double value, int digits);

/// 16 hexadecimal digits, as hashes are told.
[[nodiscard]] std::string hash_text(std::uint64_t value);

}  // namespace haptic::tools
