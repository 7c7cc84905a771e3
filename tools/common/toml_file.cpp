// SPDX-License-Identifier: Apache-2.0
#include "tools/common/toml_file.hpp"

#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/toml_text.hpp"

namespace haptic::tools {

toml::table parse_toml(std::string_view text, const std::string& file) {
  check_toml_text(text, file);
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    const toml::source_position at = error.source().begin;
    throw InputError(file + ":" + std::to_string(at.line) + ":" + std::to_string(at.column) +
                     ": not valid TOML: " + std::string(error.description()) + "; fix the line");
  }
}

toml::table read_toml_file(const std::string& path, std::size_t largest_bytes,
                           const std::string& role) {
  return parse_toml(read_text_file(path, largest_bytes, role), path);
}

}  // namespace haptic::tools
