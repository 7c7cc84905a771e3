// SPDX-License-Identifier: Apache-2.0
#include "tools/library/message_record.hpp"

#include <cctype>
#include <string_view>

namespace haptic::tools {
namespace {

std::size_t digits_at(std::string_view text, std::size_t at) {
  std::size_t end = at;
  while (end < text.size() && std::isdigit(static_cast<unsigned char>(text[end])) != 0) ++end;
  return end - at;
}

/// Takes "12" or "12:3" and the colon and blank after it off the front of `rest`, or "byte 812: ".
std::string take_place(std::string_view& rest) {
  std::string_view whole = rest;
  std::size_t end = digits_at(whole, 0);
  if (end > 0 && end + 1 < whole.size() && whole[end] == ':') {
    const std::size_t column = digits_at(whole, end + 1);
    if (column > 0) end += 1 + column;
  } else if (constexpr std::string_view kByte = "byte "; whole.starts_with(kByte)) {
    end = kByte.size() + digits_at(whole, kByte.size());
  }
  if (end == 0 || whole.substr(end, 2) != ": ") return {};
  rest = whole.substr(end + 2);
  return std::string(whole.substr(0, end));
}

}  // namespace

MessageRecord message_record(std::uint32_t severity, const std::string& text,
                             const std::vector<std::string>& files) {
  MessageRecord record;
  record.severity = severity;
  record.text = text;
  std::string_view rest = text;
  for (const std::string& file : files) {
    if (file.empty() || file.size() <= record.file.size() || !text.starts_with(file + ":"))
      continue;
    record.file = file;
  }
  if (!record.file.empty()) {
    rest = rest.substr(record.file.size() + 1);
    if (rest.starts_with(' ')) rest = rest.substr(1);
    record.place = take_place(rest);
  }
  const std::size_t semicolon = rest.rfind("; ");
  record.cause = rest.substr(0, semicolon);
  if (semicolon != std::string_view::npos) record.remedy = rest.substr(semicolon + 2);
  return record;
}

}  // namespace haptic::tools
