// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A whole TOML file, as a table of the library.

#include <toml++/toml.h>
#include <cstddef>
#include <string>

namespace haptic::tools {

/// `role`: as in read_text_file. @throws InputError "path:LINE: defect" where it is no TOML, and as
/// read_text_file and check_toml_text do.
[[nodiscard]] toml::table read_toml_file(const std::string& path, std::size_t largest_bytes,
                                         const std::string& role);

}  // namespace haptic::tools
