// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A first look at TOML text, before the library that reads it.

#include <cstddef>
#include <string>
#include <string_view>

namespace haptic::tools {

/// Parts of a dotted key ("rendering.law" has two), and of the heading of a table.
inline constexpr std::size_t kMaxTomlKeyParts = 32;

/// Refuses two kinds of text that toml++ 3.3 does not refuse safely: letters beyond ASCII outside
/// of strings and comments (TOML 1.0 allows none; its test for blanks runs into an unreachable
/// statement), and keys of very many parts (each is a table within a table, released by recursion:
/// a file of 1 MB exhausts the stack). Strings over several lines must be ASCII too: after a joined
/// line they are tested in the same way.
/// @param file  for the message.
/// @throws InputError "file:LINE:COLUMN: defect; mend", columns counted in characters from 1.
/// Cost: linear. Text that is no TOML for other reasons passes; the library refuses it.
void check_toml_text(std::string_view text, const std::string& file);

}  // namespace haptic::tools
