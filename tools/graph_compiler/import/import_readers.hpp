// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One function for each library that reads meshes; not used outside this folder. Where a library
/// is absent its function refuses every file.

#include "tools/graph_compiler/import/mesh_import.hpp"

namespace haptic::tools {

ImportedMesh import_by_assimp(std::span<const char> bytes, ImportFormat format,
                              const std::string& file, const std::filesystem::path& folder);
ImportedMesh import_step(std::span<const char> bytes, const std::string& file,
                         const ImportOptions& options);

/// @throws InputError  the library is absent; `fix` names the packages.
[[noreturn]] void refuse_unbuilt(const std::string& file, const std::string& fix);

}  // namespace haptic::tools
