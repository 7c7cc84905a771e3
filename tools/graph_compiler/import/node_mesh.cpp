// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/node_mesh.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include "tools/common/toml_table.hpp"
#include "tools/graph_compiler/mesh/mesh_nodes.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

/// So many nodes are named in a message.
constexpr std::size_t kMostNodesNamed = 100;

std::string listed_nodes(const std::vector<NamedNode>& nodes) {
  std::string text;
  for (std::size_t k = 0; k < std::min(nodes.size(), kMostNodesNamed); ++k) {
    text += (k == 0 ? "" : ", ") + shown_name(nodes[k].name);
  }
  if (nodes.size() > kMostNodesNamed) {
    text += " and " + std::to_string(nodes.size() - kMostNodesNamed) + " more";
  }
  return text;
}

std::string told_of(const std::vector<NamedNode>& nodes) {
  if (nodes.empty()) return "the file has no named nodes";
  return (nodes.size() == 1 ? "its only node is " : "its nodes are ") + listed_nodes(nodes);
}

}  // namespace

std::string nodes_told(const RawMesh& mesh) { return told_of(named_nodes(mesh)); }

std::uint32_t node_named(const RawMesh& mesh, const std::string& name) {
  const std::vector<NamedNode> nodes = named_nodes(mesh);
  const std::string wanted = tidy_name(name, "");
  std::vector<NamedNode> sharing;
  std::vector<std::string_view> known;
  for (const NamedNode& node : nodes) {
    if (node.name == wanted) return node.node;
    if (mesh.nodes[node.node].name == wanted) sharing.push_back(node);
    known.emplace_back(node.name);
  }
  if (!sharing.empty()) {
    refuse_file(mesh.file,
                std::to_string(sharing.size()) + " nodes have the name " + shown_name(wanted),
                "name one of " + listed_nodes(sharing) + "; " + told_of(nodes));
  }
  if (nodes.empty()) {
    refuse_file(mesh.file, "no node " + shown_name(wanted),
                told_of(nodes) + ": leave out # and the name, which takes the whole file");
  }
  const std::string nearest = nearest_word(wanted, known);
  refuse_file(
      mesh.file, "no node " + shown_name(wanted),
      (nearest.empty() ? "" : "did you mean " + shown_name(nearest) + "? ") + told_of(nodes));
}

RawMesh mesh_of_node(const RawMesh& mesh, const std::string& name) {
  const std::uint32_t node = node_named(mesh, name);
  return mesh_of_faces(mesh, faces_of_node(mesh, node), tidy_name(name, ""));
}

ImportedMesh node_of(const ImportedMesh& whole, const std::string& name) {
  const RawMesh& mesh = whole.mesh;
  const std::vector<bool> chosen = faces_of_node(mesh, node_named(mesh, name));
  ImportedMesh node{mesh_of_faces(mesh, chosen, tidy_name(name, "")), whole.unit_m,
                    whole.deflection};
  if (!whole.deflection || whole.node_deflections.empty()) return node;
  node.deflection = Deflection{};
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (!chosen[f]) continue;
    const Deflection& of = whole.node_deflections[mesh.group_nodes[mesh.faces[f].group]];
    node.deflection->asked_m = std::max(node.deflection->asked_m, of.asked_m);
    node.deflection->found_m = std::max(node.deflection->found_m, of.found_m);
  }
  return node;
}

}  // namespace haptic::tools
