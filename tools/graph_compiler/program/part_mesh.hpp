// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The mesh of a part of the scene, wherever it comes from: a file or a node of it, a link of a
/// robot description, or dimensions.

#include <array>
#include <optional>
#include <string>

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

/// @param scene_file  for messages about its keys.
/// @throws InputError: the mesh cannot be read; the file has no such node; scale_to_m is not the
/// unit that the file states.
PartMesh read_part_mesh(const ScenePart& part, const std::string& scene_file);

/// The name that the compiled scene keeps.
std::string body_name(const ScenePart& part);

}  // namespace haptic::tools
