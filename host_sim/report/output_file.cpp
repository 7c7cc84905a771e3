// SPDX-License-Identifier: Apache-2.0
#include "host_sim/report/output_file.hpp"

#include <charconv>
#include <span>

#include "tools/common/files.hpp"

namespace haptic::sim {

void write_whole_file(const std::string& path, std::string_view content) {
  tools::write_files({{path, std::as_bytes(std::span(content))}});
}

void append_number(std::string& text, double value) {
  char buffer[40];
  const auto end =
      std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, 17);
  text.append(buffer, end.ptr);
}

}  // namespace haptic::sim
