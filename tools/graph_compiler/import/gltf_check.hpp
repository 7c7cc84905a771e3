// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Finds what assimp overlooks or misnames in glTF: extensions that the file cannot do without, and
/// buffers in files of their own.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace haptic::tools {

/// True for a file that a .gltf may open: below `folder`, with the extension .bin.
bool is_gltf_buffer(const std::filesystem::path& folder, const std::filesystem::path& name);

/// @param folder  of a .gltf; empty: no file may be opened.
/// @return how many triangles the meshes of the scene's nodes hold, each mesh once: assimp leaves
/// those out in silence that use vertices that are not there.
/// @throws InputError "file: defect; fix": the JSON is damaged, or of another version; an extension
/// is required that changes geometry or is unknown; corners are no floats; a buffer is missing, or
/// does not lie below the folder. Cost: linear in the bytes of the JSON.
[[nodiscard]] std::uint64_t check_gltf(std::span<const char> bytes, bool is_glb,
                                       const std::string& file,
                                       const std::filesystem::path& folder);

}  // namespace haptic::tools
