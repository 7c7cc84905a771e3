// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Nodes of a mesh file: the names by which one is asked for, and its mesh.
///
/// A node with faces of its own is these faces; one without is all that stands below it. A node
/// that has no face in this sense is not named here, nor is one above a single other node of the
/// same name, which is the same mesh.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

/// Most nodes of a file.
inline constexpr std::size_t kMaxMeshNodes = 1'000'000;

/// A name in one line of valid UTF-8, without blanks around it: control characters become blanks,
/// bytes of no character become '?', what is beyond 200 bytes is cut. `word` where nothing is left.
std::string tidy_name(std::string_view name, std::string_view word);

struct NamedNode {
  std::string name;        ///< no other node of the file has it
  std::uint32_t node = 0;  ///< index into RawMesh::nodes
  bool is_part = false;    ///< of an assembly: all parts together are all faces, each once
};

/// All nodes with faces, in the order of the file. A name that several of them have gets a number:
/// "bolt:1", "bolt:2", in the order of the file; a number that makes the name of another node is
/// passed over. Cost: linear in faces and nodes, but for sorting the names.
std::vector<NamedNode> named_nodes(const RawMesh& mesh);

/// For every face whether it is of the node. Cost: linear in faces and nodes.
std::vector<bool> faces_of_node(const RawMesh& mesh, std::uint32_t node);

/// These faces with the corners that they use, at their places in the file, without nodes. `file`
/// of the result is that of the mesh, '#' and `name`; warnings and notes are those of the file.
RawMesh mesh_of_faces(const RawMesh& mesh, const std::vector<bool>& chosen,
                      const std::string& name);

}  // namespace haptic::tools
