// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Whole files in, whole files out. A file that is written appears complete or not at all.

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"

namespace haptic::tools {

/// @throws InputError when the file is missing, a folder, unreadable or larger than `limit` bytes.
/// `role`: what it is to this run, for note_input (tools/common/file_roles.hpp).
std::string read_text_file(const std::filesystem::path& path, std::size_t limit,
                           const std::string& role);

/// A compiled scene in aligned memory, unchecked but for this: of a large file, header and section
/// table must state its size before any room is made for it. @throws InputError as above.
SceneBytes read_scene_bytes(const std::filesystem::path& path);

/// A file to be written.
struct PendingFile {
  std::filesystem::path path;
  std::span<const std::byte> bytes;
};

/// Writes every file to a temporary beside it, and only when all are on disk renames them into
/// place: on any failure no file has changed and no temporary is left (a failing rename, after all
/// were written, can leave earlier files renamed). A link keeps its place, its target is written. A
/// device such as /dev/stdout or a pipe is written directly.
/// @throws OsError naming the path and the reason; UsageError when a path is an input of this run
/// or
///         a file of another kind (tools/common/file_roles.hpp).
void write_files(const std::vector<PendingFile>& files);

}  // namespace haptic::tools
