// SPDX-License-Identifier: Apache-2.0
#include "tools/common/formatted.hpp"

#include <cstdarg>
#include <cstddef>
#include <cstdio>
#include <stdexcept>

namespace haptic::tools {
namespace {

void append(std::string& text, const char* format, va_list arguments) {
  va_list measured;
  va_copy(measured, arguments);
  const int length = std::vsnprintf(nullptr, 0, format, measured);
  va_end(measured);
  if (length < 0)
    throw std::logic_error("a text cannot be formatted as '" + std::string(format) + "'");
  const std::size_t begin = text.size();
  text.resize(begin + static_cast<std::size_t>(length) + 1);  // with the zero that it writes
  std::vsnprintf(text.data() + begin, static_cast<std::size_t>(length) + 1, format, arguments);
  text.pop_back();
}

}  // namespace

std::string formatted(const char* format, ...) {
  std::string text;
  va_list arguments;
  va_start(arguments, format);
  append(text, format, arguments);
  va_end(arguments);
  return text;
}

void append_line(std::string& text, const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  append(text, format, arguments);
  va_end(arguments);
  text += '\n';
}

std::string unsigned_zero(std::string shown) {
  const bool is_zero =
      shown.starts_with('-') && shown.find_first_of("123456789nN") == std::string::npos;
  if (is_zero) shown.erase(0, 1);
  return shown;
}

std::string short_number(double value, int digits) { return formatted("%.*g", digits, value); }

std::string hash_text(std::uint64_t value) {
  return formatted("%016llx", static_cast<unsigned long long>(value));
}

}  // namespace haptic::tools
