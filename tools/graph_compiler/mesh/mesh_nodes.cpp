// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/mesh_nodes.hpp"

#include <algorithm>
#include <map>
#include <set>

namespace haptic::tools {
namespace {

constexpr std::size_t kLongestName = 200;

/// Bytes of the UTF-8 character that begins at `at`; 0 where none does.
std::size_t character_bytes(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t k) {
    return k < text.size() ? static_cast<unsigned char>(text[k]) : 0U;
  };
  const unsigned first = byte(at);
  if (first < 0x80) return 1;
  const std::size_t size = first < 0xC2 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  if (size == 0 || first > 0xF4) return 0;
  for (std::size_t k = 1; k < size; ++k) {
    if ((byte(at + k) & 0xC0U) != 0x80U) return 0;
  }
  const unsigned second = byte(at + 1);
  // Longer than need be, halves of UTF-16 pairs, and beyond the last character.
  const bool is_none = (first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F) ||
                       (first == 0xF0 && second < 0x90) || (first == 0xF4 && second > 0x8F);
  return is_none ? 0 : size;
}

/// The faces of a mesh by its nodes.
class NodeFaces {
 public:
  explicit NodeFaces(const RawMesh& mesh)
      : nodes_(mesh.nodes), own_(nodes_.size(), false), below_(nodes_.size(), 0) {
    only_.resize(nodes_.size(), MeshNode::kNone);
    for (const RawFace& face : mesh.faces) own_[mesh.group_nodes[face.group]] = true;
    for (std::size_t k = nodes_.size(); k-- > 0;) {
      const std::uint32_t above = nodes_[k].parent;
      if (above == MeshNode::kNone || !has(k)) continue;
      ++below_[above];
      only_[above] = static_cast<std::uint32_t>(k);
    }
  }
  [[nodiscard]] bool own(std::size_t node) const { return own_[node]; }
  [[nodiscard]] bool has(std::size_t node) const { return own_[node] || below_[node] > 0; }
  /// Above a single other node of the same name.
  [[nodiscard]] bool is_wrapper(std::size_t node) const {
    return !own_[node] && below_[node] == 1 && nodes_[only_[node]].name == nodes_[node].name;
  }

 private:
  const std::vector<MeshNode>& nodes_;
  std::vector<bool> own_;
  std::vector<std::size_t> below_;   ///< how many nodes with faces are next below
  std::vector<std::uint32_t> only_;  ///< one of these
};

}  // namespace

std::string tidy_name(std::string_view name, std::string_view word) {
  std::string text;
  for (std::size_t at = 0; at < name.size();) {
    const std::size_t size = character_bytes(name, at);
    if (text.size() + std::max<std::size_t>(size, 1) > kLongestName) break;
    const auto byte = static_cast<unsigned char>(name[at]);
    if (size == 0) {
      text += '?';
    } else if (byte < 0x20 || byte == 0x7F) {
      text += ' ';
    } else {
      text += name.substr(at, size);
    }
    at += std::max<std::size_t>(size, 1);
  }
  text.erase(0, text.find_first_not_of(' '));
  text.erase(text.find_last_not_of(' ') + 1);
  return text.empty() ? std::string(word) : text;
}

std::vector<NamedNode> named_nodes(const RawMesh& mesh) {
  if (mesh.nodes.empty()) return {};
  const NodeFaces faces(mesh);
  std::vector<NamedNode> named;
  std::map<std::string, std::size_t> sharing;
  std::vector<bool> is_part(mesh.nodes.size(), false);
  for (std::size_t k = 0; k < mesh.nodes.size(); ++k) {
    const auto& [name, above, marked] = mesh.nodes[k];
    is_part[k] = marked || (above != MeshNode::kNone && faces.is_wrapper(above) && is_part[above]);
    if (!faces.has(k) || faces.is_wrapper(k)) continue;
    named.push_back({name, static_cast<std::uint32_t>(k), is_part[k]});
    ++sharing[name];
  }
  std::map<std::string, std::size_t> last;
  std::set<std::string> numbered;
  for (NamedNode& node : named) {
    if (sharing[node.name] == 1) continue;
    std::string name;
    do {
      name = node.name + ":" + std::to_string(++last[node.name]);
    } while (sharing.contains(name) || !numbered.insert(name).second);
    node.name = std::move(name);
  }
  return named;
}

std::vector<bool> faces_of_node(const RawMesh& mesh, std::uint32_t node) {
  const NodeFaces faces(mesh);
  std::vector<bool> in(mesh.nodes.size(), false);
  in[node] = true;
  if (!faces.own(node)) {
    for (std::size_t k = node + 1; k < mesh.nodes.size(); ++k) {
      const std::uint32_t above = mesh.nodes[k].parent;
      in[k] = above != MeshNode::kNone && in[above];
    }
  }
  std::vector<bool> chosen;
  chosen.reserve(mesh.faces.size());
  for (const RawFace& face : mesh.faces) chosen.push_back(in[mesh.group_nodes[face.group]]);
  return chosen;
}

RawMesh mesh_of_faces(const RawMesh& mesh, const std::vector<bool>& chosen,
                      const std::string& name) {
  constexpr std::uint32_t kUnused = 0xFFFFFFFFU;
  RawMesh part;
  part.file = mesh.file + "#" + name;
  part.indexed = mesh.indexed;
  part.places_are_lines = mesh.places_are_lines;
  part.print_resolution = mesh.print_resolution;
  part.warnings = mesh.warnings;
  part.notes = mesh.notes;
  std::vector<std::uint32_t> own(mesh.vertices.size(), kUnused);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (!chosen[f]) continue;
    RawFace& face = part.faces.emplace_back(mesh.faces[f]);
    for (std::uint32_t& v : face.vertices) {
      std::uint32_t& to = own[v];
      if (to == kUnused) {
        to = static_cast<std::uint32_t>(part.vertices.size());
        part.vertices.push_back(mesh.vertices[v]);
        part.vertex_places.push_back(mesh.vertex_places[v]);
      }
      v = to;
    }
  }
  return part;
}

}  // namespace haptic::tools
