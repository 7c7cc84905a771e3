// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Mesh formats that are read through other libraries: 3MF, glTF 2 (.gltf, .glb), COLLADA
/// (.dae) and AMF through assimp. Optional: a build without the libraries refuses such files and
/// names the packages.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

enum class ImportFormat : std::uint8_t { k3mf, kGltf, kGlb, kDae, kAmf };

struct ImportedMesh {
  RawMesh mesh;         ///< in metres
  double unit_m = 1.0;  ///< of the file [m]
};

/// Format by the extension of the file name (any case); nothing where it is none of these.
std::optional<ImportFormat> import_format_of(const std::filesystem::path& path);
/// Folder that names in the file count from.
std::filesystem::path folder_of(const std::filesystem::path& path);
/// True when this build has the libraries.
bool can_import();

/// Reads a file with all its meshes, each at the place of every node that uses it; the parts stay
/// apart as groups. Lines and points are left out. The axes are those of the file.
/// The libraries run in a process of their own with limits of time and memory, and everything that
/// comes out of it is checked, so a file that makes them crash is refused like any other.
/// @throws InputError "file: defect; fix".
ImportedMesh import_mesh(const std::filesystem::path& path);

/// The same from bytes, of the first `kMaxMeshBytes` at most. A .gltf may name buffers (.bin) below
/// `folder`; nothing else is opened.
ImportedMesh import_bytes(std::span<const char> bytes, ImportFormat format, const std::string& file,
                          const std::filesystem::path& folder);

/// The collision model of a link of a robot description (URDF), in the frame of the link and in
/// metres: boxes, cylinders, spheres and meshes with their origins and scales. Names of meshes
/// count from the folder of the URDF; "package://NAME/PATH" is looked for as NAME/PATH in that
/// folder and the folders above.
/// @throws InputError "file:line: defect; fix".
RawMesh link_mesh(const std::filesystem::path& urdf, const std::string& link);

/// The same from text.
RawMesh link_mesh_of(const std::string& text, const std::string& file,
                     const std::filesystem::path& folder, const std::string& link);

}  // namespace haptic::tools
