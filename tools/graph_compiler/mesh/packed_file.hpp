// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Meshes that were brought as they travel: packed by gzip and its like.

#include <filesystem>
#include <span>
#include <string>

namespace haptic::tools {

/// Refuses bytes that begin as those of gzip, bzip2, xz or Zstandard do; the message says how they
/// are unpacked. So are what stands where a mesh should be: pointers of Git LFS, and web pages. No
/// mesh format begins so. 3MF and AMF may be ZIP archives.
/// @throws InputError
void refuse_packed(std::span<const char> bytes, const std::string& file);
/// Refuses a ZIP archive in the same way. @throws InputError
void refuse_archive(std::span<const char> bytes, const std::string& file);

/// The same by the extension alone, such as that of "part.stl.gz", which hides the format.
/// @throws InputError
void refuse_packed_name(const std::filesystem::path& path);

}  // namespace haptic::tools
