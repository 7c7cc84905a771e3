// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The mesh of a part of the scene, wherever it comes from: a file or a node of it, a link of a
/// robot description, or dimensions.

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/mesh/surface.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"

namespace haptic::tools {

struct PartMesh {
  RawMesh mesh;
  std::array<double, 3> scale_to_m{1, 1, 1};  ///< that is still to be applied
  std::array<double, 3> unit_m{1, 1, 1};      ///< of the file, for the report
  std::optional<Deflection> deflection{};     ///< of STEP
};

/// Files of which several parts are nodes: each is read once, and kept.
class MeshFiles {
 public:
  /// The whole file of `part`, with all its nodes. @throws InputError: it cannot be read.
  const ImportedMesh& whole(const ScenePart& part);

 private:
  std::map<std::pair<std::filesystem::path, double>, ImportedMesh>
      read_;  ///< by the deflection too
};

/// @param scene_file  for messages about its keys. @param files  kept between parts; may be null.
/// @throws InputError: the mesh cannot be read; the file has no such node; scale_to_m is not the
/// unit that the file states.
PartMesh read_part_mesh(const ScenePart& part, const std::string& scene_file,
                        MeshFiles* files = nullptr);

/// The name that the compiled scene keeps.
std::string body_name(const ScenePart& part);

}  // namespace haptic::tools
