// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Files that appear whole or not at all.

#include <string>
#include <string_view>

namespace haptic::sim {

/// Writes `content` next to `path` and renames it there; an existing file stays as it was until
/// then, and on failure.
/// @throws tools::InputError naming the file.
void write_whole_file(const std::string& path, std::string_view content);

/// Appends `value` with 17 significant digits (a double reads back as itself); "nan", "inf" as the
/// C library has them.
void append_number(std::string& text, double value);

/// Throws when a result file could not be made at `path` later: folder missing or not writable.
/// Long runs ask first.
void require_writable_folder(const std::string& path);

}  // namespace haptic::sim
