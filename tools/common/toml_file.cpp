// SPDX-License-Identifier: Apache-2.0
#include "tools/common/toml_file.hpp"

#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/toml_text.hpp"

namespace haptic::tools {

toml::table read_toml_file(const std::string& path, std::size_t largest_bytes,
                           const std::string& role) {
  const std::string text = read_text_file(path, largest_bytes, role);
  check_toml_text(text, path);
  try {
    return toml::parse(text, path);
  } catch (const toml::parse_error& error) {
    throw InputError(path + ":" + std::to_string(error.source().begin.line) +
                     ": not valid TOML: " + std::string(error.description()));
  }
}

}  // namespace haptic::tools
