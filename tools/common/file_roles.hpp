// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which files a run reads and which it writes, so that no output replaces an input, another output
/// or a file of another kind. A reader of a user's file notes it; a command claims its outputs when
/// it has read its inputs, before it begins to work. Two names are one file when they lead to the
/// same file on disk: by another spelling, by a symbolic link or by a hard link.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "tools/common/file_kind.hpp"

namespace haptic::tools {

/// Registers a file that is read; `role` completes "would overwrite ...", such as "the motion".
/// Devices and pipes are not registered. Any thread.
/// @throws UsageError when an output of this run is the same file.
/// @throws InputError the path is empty, names no file or a folder, or cannot be read.
void note_input(const std::filesystem::path& path, const std::string& role);

/// Registers a file that will be written for the option `role`, such as "--out"; an empty path
/// registers nothing. Writes nothing. `kind`: what will be written.
/// @throws UsageError when an input or another output is the same file, or a file of another kind
///                    is there (require_replaceable).
/// @throws OsError    the folder is missing or is a file, the path is a folder, or is not writable.
void claim_output(const std::filesystem::path& path, const std::string& role, const FileKind& kind);

/// Registers a folder that results are written into, and makes it where it does not exist. `names`:
/// of the files in it; * stands for any characters. An empty path registers nothing.
/// @throws UsageError when one of the names is an input or another output, or is there and of
///                    another format than its name says.
/// @throws OsError    the folder cannot be made or written.
void claim_folder(const std::filesystem::path& path, const std::string& role,
                  const std::vector<std::string>& names);

/// An existing file is replaced only by a file of its own kind; an empty one, a device and a pipe
/// by any. `role` writes it: "--out". @throws UsageError naming the file, what it is and what would
/// be written; OsError when it cannot be read.
void require_replaceable(const std::filesystem::path& path, const std::string& role,
                         const FileKind& kind);

/// The last check before a file is written. @throws UsageError when it is an input of this run, or
/// holds a file of another kind than `content`.
void require_no_loss(const std::filesystem::path& path, std::string_view content);

/// For a command that draws an SVG. @throws UsageError when `path` is named as another kind of
/// picture.
void require_svg_name(const std::string& path, const std::string& role);

/// Forgets every file: for tests, which hold many runs in one process.
void forget_file_roles();

}  // namespace haptic::tools
