// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/text_scan.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
char to_lower(char c) { return (c >= 'A' && c <= 'Z') ? static_cast<char>(c - 'A' + 'a') : c; }

/// Digits after the decimal point less the exponent, of a word that is known to be a number.
int digits_after_point(std::string_view word) {
  const std::size_t exponent_at = word.find_first_of("eE");
  const std::string_view mantissa = word.substr(0, exponent_at);
  const std::size_t point = mantissa.find('.');
  int digits = 0;
  if (point != std::string_view::npos) {
    digits = static_cast<int>(std::min<std::size_t>(mantissa.size() - point - 1, 1000));
  }
  if (exponent_at != std::string_view::npos) {
    std::string_view text = word.substr(exponent_at + 1);
    if (!text.empty() && text.front() == '+') {
      text.remove_prefix(1);
    }
    int exponent = 0;
    const auto result = std::from_chars(text.data(), text.data() + text.size(), exponent);
    if (result.ec == std::errc{}) {
      digits -= std::clamp(exponent, -1000, 1000);
    }
  }
  return digits;
}

}  // namespace

void refuse_line(const std::string& file, std::size_t line, const std::string& defect,
                 const std::string& fix) {
  throw InputError(file + ":" + std::to_string(line) + ": " + defect + "; " + fix);
}

void refuse_byte(const std::string& file, std::size_t byte, const std::string& defect,
                 const std::string& fix) {
  throw InputError(file + ": byte " + std::to_string(byte) + ": " + defect + "; " + fix);
}

void refuse_file(const std::string& file, const std::string& defect, const std::string& fix) {
  throw InputError(file + ": " + defect + "; " + fix);
}

std::string shown_word(std::string_view word) {
  constexpr std::size_t kLongest = 40;
  std::string text = "'";
  for (const char c : word.substr(0, kLongest)) {
    text += (c >= ' ' && c <= '~') ? c : '?';
  }
  text += word.size() > kLongest ? "...'" : "'";
  return text;
}

std::string shown_name(std::string_view name) {
  std::string text = "'";
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    text += byte < 0x20 || byte == 0x7F ? '?' : c;
  }
  return text + "'";
}

std::string_view checked_text(std::span<const char> bytes, const std::string& file) {
  std::string_view text(bytes.data(), bytes.size());
  if (text.empty()) {
    refuse_file(file, "the file is empty (0 bytes)", "export the part again");
  }
  const bool mark = text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF");
  const bool wide = text.size() >= 2 && ((text[0] == '\0') != (text[1] == '\0'));
  if (mark || wide) {
    refuse_byte(file, 0, "the text is UTF-16", "save the file as UTF-8 or plain ASCII");
  }
  if (text.starts_with("\xEF\xBB\xBF")) {
    text.remove_prefix(3);
  }
  const std::size_t zero = text.find('\0');
  if (zero != std::string_view::npos) {
    refuse_byte(file, zero + (bytes.size() - text.size()), "binary data in a text format",
                "check that the extension names the true format, or export the part again");
  }
  return text;
}

std::string_view LineScanner::next_physical_line() {
  const std::size_t begin = position_;
  const std::size_t end = text_.find_first_of("\r\n", begin);
  ++line_;
  if (end == std::string_view::npos) {
    position_ = text_.size();
    unfinished_ = true;
    return text_.substr(begin);
  }
  position_ = end + 1;
  if (text_[end] == '\r' && position_ < text_.size() && text_[position_] == '\n') {
    ++position_;
  }
  return text_.substr(begin, end - begin);
}

bool LineScanner::next(std::vector<std::string_view>& words) {
  words.clear();
  while (words.empty() && position_ < text_.size()) {
    first_line_ = line_ + 1;
    bool joined = true;
    while (joined && position_ < text_.size()) {
      std::string_view line = next_physical_line();
      joined = false;
      if (options_.comments) {
        line = line.substr(0, line.find('#'));
      }
      if (options_.continuation && line.ends_with('\\')) {
        line.remove_suffix(1);
        joined = true;
      }
      std::size_t at = 0;
      while (at < line.size()) {
        while (at < line.size() && is_blank(line[at])) {
          ++at;
        }
        const std::size_t begin = at;
        while (at < line.size() && !is_blank(line[at])) {
          ++at;
        }
        if (at > begin) {
          words.push_back(line.substr(begin, at - begin));
        }
      }
    }
  }
  return !words.empty();
}

double PrintedDigits::resolution() const {
  if (!any) {
    return 0.0;
  }
  // Through the correctly rounded conversion: the same double with every mathematics library.
  const std::string power = "1e" + std::to_string(-std::clamp(most, -300, 300));
  double value = 0.0;
  std::from_chars(power.data(), power.data() + power.size(), value);
  return value;
}

double parse_number(std::string_view word, const std::string& file, std::size_t line,
                    const char* what, PrintedDigits* printed) {
  std::string_view number = word;
  if (number.size() > 1 && number[0] == '+' && (is_digit(number[1]) || number[1] == '.')) {
    number.remove_prefix(1);
  }
  double value = 0.0;
  const char* const end = number.data() + number.size();
  const auto result = std::from_chars(number.data(), end, value, std::chars_format::general);
  const std::string name = std::string(what) + " " + shown_word(word);
  if (number.find(',') != std::string_view::npos) {
    refuse_line(file, line, name + " has a comma", "write numbers with a decimal point");
  }
  if (result.ec == std::errc::invalid_argument || result.ptr != end) {
    refuse_line(file, line, name + " is not a number", "write a decimal number");
  }
  if (result.ec == std::errc::result_out_of_range) {
    const bool tiny = digits_after_point(number) > 0;
    if (!tiny) {
      refuse_line(file, line, name + " is too large for a double", "check the unit of the export");
    }
    value = 0.0;
  }
  if (!std::isfinite(value)) {
    refuse_line(file, line, name + " is not finite", "export the part again or delete the face");
  }
  if (printed != nullptr) {
    printed->most = printed->any ? std::max(printed->most, digits_after_point(number))
                                 : digits_after_point(number);
    printed->any = true;
  }
  return value;
}

std::int64_t parse_integer(std::string_view word, const std::string& file, std::size_t line,
                           const char* what) {
  std::int64_t value = 0;
  const char* const end = word.data() + word.size();
  const auto result = std::from_chars(word.data(), end, value);
  const std::string name = std::string(what) + " " + shown_word(word);
  if (result.ec == std::errc::result_out_of_range) {
    refuse_line(file, line, name + " is too large", "correct the number");
  }
  if (result.ec != std::errc{} || result.ptr != end) {
    refuse_line(file, line, name + " is not an integer", "correct the number");
  }
  return value;
}

bool equals_lower(std::string_view word, std::string_view lower) {
  return word.size() == lower.size() && std::equal(word.begin(), word.end(), lower.begin(),
                                                   [](char a, char b) { return to_lower(a) == b; });
}

}  // namespace haptic::tools
