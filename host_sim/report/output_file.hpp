// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Files that appear whole or not at all.

#include <string>
#include <string_view>

namespace haptic::sim {

/// tools::write_files (tools/common/files.hpp) of one file.
void write_whole_file(const std::string& path, std::string_view content);

/// Appends `value` with 17 significant digits (a double reads back as itself); "nan", "inf" as the
/// C library has them.
void append_number(std::string& text, double value);

}  // namespace haptic::sim
