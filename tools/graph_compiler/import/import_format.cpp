// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "tools/common/files.hpp"
#include "tools/graph_compiler/import/import_readers.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/packed_file.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {

std::optional<ImportFormat> import_format_of(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  constexpr std::pair<std::string_view, ImportFormat> kFormats[] = {
      {".3mf", ImportFormat::k3mf}, {".gltf", ImportFormat::kGltf}, {".glb", ImportFormat::kGlb},
      {".dae", ImportFormat::kDae}, {".amf", ImportFormat::kAmf},   {".step", ImportFormat::kStep},
      {".stp", ImportFormat::kStep}};
  for (const auto& [name, format] : kFormats) {
    if (equals_lower(extension, name)) return format;
  }
  return std::nullopt;
}

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

void refuse_unbuilt(const std::string& file, const std::string& fix) {
  refuse_file(file, "this program was built without the libraries that read such files", fix);
}

ImportedMesh import_bytes(std::span<const char> bytes, ImportFormat format, const std::string& file,
                          const std::filesystem::path& folder, const ImportOptions& options) {
  refuse_packed(bytes, file);
  if (format == ImportFormat::kStep) return import_step(bytes, file, options);
  return import_by_assimp(bytes, format, file, folder);
}

ImportedMesh import_mesh(const std::filesystem::path& path, const ImportOptions& options) {
  const std::string bytes = read_text_file(path, kMaxMeshBytes, "a mesh of the scene");
  return import_bytes(bytes, *import_format_of(path), path.string(), folder_of(path), options);
}

}  // namespace haptic::tools
