// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/part_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/import/node_mesh.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"

namespace haptic::tools {
namespace {

/// Units are written with few digits, such as 0.0254.
constexpr double kSameUnit = 1e-6;

void check_unit(const ScenePart& part, double unit_m, const std::string& scene_file) {
  if (!part.scale_at) return;
  const bool agrees = std::ranges::all_of(part.scale_to_m, [&](double scale) {
    return std::abs(scale - unit_m) <= kSameUnit * unit_m;
  });
  if (agrees) return;
  throw InputError(formatted(
      "%s:%u:%u: scale_to_m of %s is not %.9g m, the unit that the file "
      "states; leave scale_to_m out, or correct the file",
      scene_file.c_str(), part.scale_at->line, part.scale_at->column, part.mesh.c_str(), unit_m));
}

ImportedMesh file_mesh(const ScenePart& part) {
  if (import_format_of(part.path)) return import_mesh(part.path, {part.deflection_m});
  return {read_mesh(part.path), 1.0, {}};
}

}  // namespace

const ImportedMesh& MeshFiles::whole(const ScenePart& part) {
  const std::pair key(part.path, part.deflection_m.value_or(0.0));
  const auto known = read_.find(key);
  return known != read_.end() ? known->second : read_.emplace(key, file_mesh(part)).first->second;
}

PartMesh read_part_mesh(const ScenePart& part, const std::string& scene_file, MeshFiles* files) {
  if (part.given) return {*part.given, part.scale_to_m, part.scale_to_m, {}};
  if (part.shape) return {.mesh = shape_mesh(*part.shape, part.mesh)};
  if (part.link) return {.mesh = link_mesh(part.path, *part.link, part.link_frame)};
  MeshFiles own;
  ImportedMesh mesh = part.node ? node_of((files != nullptr ? *files : own).whole(part), *part.node)
                                : file_mesh(part);
  if (!import_format_of(part.path)) {
    return {std::move(mesh.mesh), part.scale_to_m, part.scale_to_m, {}};
  }
  const double unit_m = mesh.unit_m;
  check_unit(part, unit_m, scene_file);
  return {std::move(mesh.mesh), {1, 1, 1}, {unit_m, unit_m, unit_m}, mesh.deflection};
}

std::string body_name(const ScenePart& part) {
  if (!part.name.empty()) return part.name;
  if (part.shape) return part.mesh;
  const std::string name = part.path.filename().string();
  const std::optional<std::string>& of = part.link ? part.link : part.node;
  return of ? name + "#" + *of : name;
}

}  // namespace haptic::tools
