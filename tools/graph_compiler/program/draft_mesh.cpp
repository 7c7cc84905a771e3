// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/draft_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/import/node_mesh.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/program/odd_sizes.hpp"

namespace haptic::tools {

double DraftBox::diagonal() const {
  double square = 0.0;
  for (std::size_t k = 0; k < 3; ++k) square += (high[k] - low[k]) * (high[k] - low[k]);
  return std::sqrt(square);
}

DraftBox DraftMesh::box() const {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  DraftBox box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  for (const Point3& v : mesh->vertices) {
    for (std::size_t k = 0; k < 3; ++k) {
      box.low[k] = std::min(box.low[k], v[k]);
      box.high[k] = std::max(box.high[k], v[k]);
    }
  }
  return box;
}

NodeName draft_source(const std::filesystem::path& given) {
  const NodeName source = split_node({}, given.string());
  const bool is_split = source.node || is_description(source.file);
  return is_split ? source : NodeName{given.string(), std::nullopt};
}

DraftMesh read_draft_mesh(const std::filesystem::path& given) {
  const NodeName source = draft_source(given);
  if (!source.node && is_description(source.file)) {
    throw InputError(source.file + ": is a robot description; give a link of it, as " +
                     source.file + "#LINK; " + collision_links(source.file));
  }
  DraftMesh read;
  read.path = source.file;
  read.name = given.string();
  RawMesh mesh;
  if (source.node && !is_mesh_file(read.path)) {
    read.link = source.node;
    read.has_unit = true;  // robot descriptions are in metres
    mesh = link_mesh(read.path, *source.node);
  } else if (import_format_of(read.path)) {
    read.node = source.node;
    read.has_unit = true;
    mesh = import_mesh(read.path).mesh;
    if (source.node) mesh = mesh_of_node(mesh, *source.node);
  } else {
    read.node = source.node;
    mesh = read_mesh(read.path);
    if (source.node) mesh = mesh_of_node(mesh, *source.node);
  }
  read.mesh = std::make_shared<const RawMesh>(std::move(mesh));
  return read;
}

FileUnit unit_of(const std::vector<DraftMesh>& meshes) {
  std::vector<double> diagonals;
  for (const DraftMesh& mesh : meshes) {
    if (!mesh.has_unit) diagonals.push_back(mesh.diagonal());
  }
  if (diagonals.empty()) return {"", 1.0};
  const auto [least, most] = std::ranges::minmax(diagonals);
  if (most > kOddRatio * least) diagonals.resize(1);
  return guessed_unit(diagonals);
}

}  // namespace haptic::tools
