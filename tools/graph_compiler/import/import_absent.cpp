// SPDX-License-Identifier: Apache-2.0
/// Stands in for the importers in a build without their libraries.
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

[[noreturn]] void refuse_unbuilt(const std::string& file) {
  refuse_file(
      file, "this program was built without the libraries that read such files",
      "install libassimp-dev, libtinyxml2-dev and zlib1g-dev, configure and build again; or "
      "convert the part to STL, OBJ, OFF or PLY");
}

}  // namespace

bool can_import() { return false; }

ImportedMesh import_mesh(const std::filesystem::path& path) { refuse_unbuilt(path.string()); }

ImportedMesh import_bytes(std::span<const char>, ImportFormat, const std::string& file,
                          const std::filesystem::path&) {
  refuse_unbuilt(file);
}

RawMesh link_mesh(const std::filesystem::path& urdf, const std::string&) {
  refuse_unbuilt(urdf.string());
}

RawMesh link_mesh_of(const std::string&, const std::string& file, const std::filesystem::path&,
                     const std::string&) {
  refuse_unbuilt(file);
}

}  // namespace haptic::tools
