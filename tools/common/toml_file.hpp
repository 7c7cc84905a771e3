// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A whole TOML text or file, as a table of the library.

#include <toml++/toml.h>
#include <cstddef>
#include <string>
#include <string_view>

namespace haptic::tools {

// A first look at TOML text, before the library that reads it.

/// Parts of a dotted key ("rendering.law" has two), and of the heading of a table.
inline constexpr std::size_t kMaxTomlKeyParts = 32;

/// Refuses two kinds of text that toml++ 3.3 does not refuse safely: letters beyond ASCII outside
/// of strings and comments (TOML 1.0 allows none; its test for blanks runs into an unreachable
/// statement), and keys of very many parts (each is a table within a table, released by recursion:
/// a file of 1 MB exhausts the stack). Strings over several lines must be ASCII too: after a joined
/// line they are tested in the same way. What is refused there by a wrong word of the library, too:
/// typographic quotes, and paths of Windows in double quotes.
/// @param file  for the message.
/// @throws InputError "file:LINE:COLUMN: defect; fix", columns counted in characters from 1.
/// Cost: linear. Text that is no TOML for other reasons passes; the library refuses it.
void check_toml_text(std::string_view text, const std::string& file);

/// Line ends are LF, CR LF, or CR alone throughout. `file`: for the message. @throws InputError
/// "file:LINE:COLUMN: defect" where it is no TOML, and as check_toml_text does.
[[nodiscard]] toml::table parse_toml(std::string_view text, const std::string& file);

/// `role`: as in read_text_file. @throws InputError as read_text_file and parse_toml do.
[[nodiscard]] toml::table read_toml_file(const std::string& path, std::size_t largest_bytes,
                                         const std::string& role);

}  // namespace haptic::tools
