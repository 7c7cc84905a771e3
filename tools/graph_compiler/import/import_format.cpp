// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {

std::optional<ImportFormat> import_format_of(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  constexpr std::pair<std::string_view, ImportFormat> kFormats[] = {{".3mf", ImportFormat::k3mf},
                                                                    {".gltf", ImportFormat::kGltf},
                                                                    {".glb", ImportFormat::kGlb},
                                                                    {".dae", ImportFormat::kDae},
                                                                    {".amf", ImportFormat::kAmf}};
  for (const auto& [name, format] : kFormats) {
    if (equals_lower(extension, name)) return format;
  }
  return std::nullopt;
}

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

}  // namespace haptic::tools
