// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A whole TOML text or file, as a table of the library.

#include <toml++/toml.h>
#include <cstddef>
#include <string>
#include <string_view>

namespace haptic::tools {

/// `file`: for the message. @throws InputError "file:LINE:COLUMN: defect" where it is no TOML, and
/// as check_toml_text does.
[[nodiscard]] toml::table parse_toml(std::string_view text, const std::string& file);

/// `role`: as in read_text_file. @throws InputError as read_text_file and parse_toml do.
[[nodiscard]] toml::table read_toml_file(const std::string& path, std::size_t largest_bytes,
                                         const std::string& role);

}  // namespace haptic::tools
