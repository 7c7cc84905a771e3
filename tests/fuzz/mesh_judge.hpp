// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What must hold of every mesh that a reader accepts, and of every refusal.

#include <cmath>
#include <set>
#include <string_view>

#include "tests/fuzz/fuzz_target.hpp"
#include "tools/graph_compiler/mesh/mesh_nodes.hpp"
#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::fuzz {

/// Nodes refer to nodes before them, groups to nodes; no two names are the same, each stays what it
/// is when it is written and read again, and has faces.
inline void check_nodes(const tools::RawMesh& mesh) {
  for (std::size_t k = 0; k < mesh.nodes.size(); ++k) {
    const tools::MeshNode& node = mesh.nodes[k];
    require(node.parent == tools::MeshNode::kNone || node.parent < k, "a node is below its parent");
    require(!node.name.empty() && tools::tidy_name(node.name, "") == node.name,
            "a name is one line");
  }
  for (const tools::RawFace& face : mesh.faces) {
    if (mesh.nodes.empty()) break;
    require(
        face.group < mesh.group_nodes.size() && mesh.group_nodes[face.group] < mesh.nodes.size(),
        "a face is of a node");
  }
  std::set<std::string> names;
  for (const tools::NamedNode& node : tools::named_nodes(mesh)) {
    require(names.insert(node.name).second, "a name is of one node");
    if (names.size() > 20) break;
    const std::vector<bool> faces = tools::faces_of_node(mesh, node.node);
    require(!tools::mesh_of_faces(mesh, faces, node.name).faces.empty(), "a named node has faces");
  }
}

/// Of what a reader gives: its parts are all faces, each once.
inline void check_parts(const tools::RawMesh& mesh) {
  if (mesh.nodes.empty()) return;
  std::vector<unsigned> count(mesh.faces.size(), 0);
  for (const tools::NamedNode& node : tools::named_nodes(mesh)) {
    if (!node.is_part) continue;
    const std::vector<bool> faces = tools::faces_of_node(mesh, node.node);
    for (std::size_t f = 0; f < faces.size(); ++f) count[f] += faces[f] ? 1U : 0U;
  }
  for (const unsigned n : count) require(n == 1, "parts are all faces, each once");
}

inline void check_raw_mesh(const tools::RawMesh& mesh) {
  require(!mesh.faces.empty(), "an accepted mesh has a face");
  require(mesh.vertex_places.size() == mesh.vertices.size(), "each vertex has a place");
  require(std::isfinite(mesh.print_resolution) && mesh.print_resolution >= 0.0,
          "the print resolution is a length");
  for (const tools::Point3& p : mesh.vertices) {
    require(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]),
            "coordinates are finite");
  }
  for (const tools::RawFace& face : mesh.faces) {
    require(face.vertices.size() >= 3, "a face has three corners");
    for (const std::uint32_t v : face.vertices) {
      require(v < mesh.vertices.size(), "corners refer to vertices");
    }
  }
  check_nodes(mesh);
}

/// The text of an InputError about the file "fuzz"; `names`: characters of names in it, which are
/// never cut.
inline void check_refusal(std::string_view text, std::size_t names = 0) {
  require(text.starts_with("fuzz:"), "a refusal begins with the file");
  require(text.find("; ") != std::string_view::npos, "a refusal names the fix");
  require(text.size() < 1000 + names, "a refusal is readable");
}

}  // namespace haptic::fuzz
