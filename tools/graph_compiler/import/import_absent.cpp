// SPDX-License-Identifier: Apache-2.0
/// Stands in for assimp and the reader of robot descriptions in a build without their libraries.
#include "tools/graph_compiler/import/import_readers.hpp"

namespace haptic::tools {
namespace {

constexpr const char* kFix =
    "install libassimp-dev, libtinyxml2-dev and zlib1g-dev, configure and build again; or convert "
    "the part to STL, OBJ, OFF or PLY";

}  // namespace

bool can_import() { return false; }

ImportedMesh import_by_assimp(std::span<const char>, ImportFormat, const std::string& file,
                              const std::filesystem::path&) {
  refuse_unbuilt(file, kFix);
}

RawMesh link_mesh(const std::filesystem::path& urdf, const std::string&, LinkFrame) {
  refuse_unbuilt(urdf.string(), kFix);
}

std::string collision_links(const std::filesystem::path& urdf) {
  refuse_unbuilt(urdf.string(), kFix);
}

RawMesh link_mesh_of(const std::string&, const std::string& file, const std::filesystem::path&,
                     const std::string&, LinkFrame) {
  refuse_unbuilt(file, kFix);
}

RawMesh robot_mesh(const std::filesystem::path& urdf) { refuse_unbuilt(urdf.string(), kFix); }

RawMesh robot_mesh_of(const std::string&, const std::string& file, const std::filesystem::path&) {
  refuse_unbuilt(file, kFix);
}

}  // namespace haptic::tools
