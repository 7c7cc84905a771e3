// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Files that another file names, as people and other systems write such names: with backslashes,
/// blanks around them, or letters of another case than on disk.

#include <filesystem>
#include <optional>
#include <string>

namespace haptic::tools {

struct FoundFile {
  std::filesystem::path path;
  std::string note;  ///< where the case of letters differs; else empty
};

/// The name without blanks around it.
std::string without_blanks(const std::string& name);

/// The same with slashes for backslashes.
std::string plain_name(const std::string& name);

/// "C:\\parts\\peg.stl", and the names of shares of a network.
bool is_windows_path(const std::string& name);

/// The regular file that `name`, which counts from `folder`, stands for: as it is written, or else
/// as plain_name has it.
std::optional<std::filesystem::path> file_as_named(const std::filesystem::path& folder,
                                                   const std::string& name);

/// The same; where there is none, the one file whose path differs in the case of letters (A to Z)
/// alone, with a note. Cost: reads the folders on the way.
/// @throws InputError several files differ from the name in this way; the message names two.
std::optional<FoundFile> named_file(const std::filesystem::path& folder, const std::string& name);

}  // namespace haptic::tools
