// SPDX-License-Identifier: Apache-2.0
#include "host_sim/motion_log/log_rows.hpp"

#include <utility>

#include "host_sim/motion_log/log_columns.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"

namespace haptic::sim {

void LogRows::refuse(const std::string& defect) const {
  throw tools::InputError(path_ + ":" + std::to_string(line_) + ": " + defect);
}

std::string_view take_log_line(std::string_view& rest) {
  const std::size_t end = rest.find_first_of("\r\n");
  const std::string_view line = rest.substr(0, end);
  if (end == std::string_view::npos) {
    rest = {};
    return line;
  }
  const bool both = rest[end] == '\r' && end + 1 < rest.size() && rest[end + 1] == '\n';
  rest.remove_prefix(end + (both ? 2 : 1));
  return line;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

std::unique_ptr<LogRows> open_log(const std::string& path) {
  std::string text = tools::read_text_file(path, kMostLogBytes, "the log");
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  if (text.starts_with("RTSCENE"))
    throw tools::InputError(path + ": is a compiled scene; give the log of a motion");
  if (text.find('\0') != std::string::npos) {
    throw tools::InputError(path +
                            ": is no text; save it as UTF-8 text (of a bag, a Parquet file or a "
                            "workbook export the poses as CSV)");
  }
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) throw tools::InputError(path + ": is empty; give a log of poses");
  if (text[first] == '[') {
    throw tools::InputError(
        path + ": is one JSON array; write an object a line, as 'jq -c .[] FILE' does");
  }
  if (text[first] == '{') return json_rows(path, std::move(text));
  return separated_rows(path, std::move(text), &holds_pose);
}

}  // namespace haptic::sim
