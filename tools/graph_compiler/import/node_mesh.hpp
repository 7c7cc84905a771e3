// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One node of a mesh file, by the name that people give: which name is what, mesh/mesh_nodes.hpp.

#include <string>

#include "tools/graph_compiler/import/mesh_import.hpp"

namespace haptic::tools {

/// "its nodes are 'a', 'b'", or that the file names none; so many and no more.
std::string nodes_told(const RawMesh& mesh);

/// The index of the node with this name, without regard to blanks around it.
/// @throws InputError "file: no node 'x'; did you mean ..? its nodes are ..", or several nodes have
/// the name, with those that tell them apart.
std::uint32_t node_named(const RawMesh& mesh, const std::string& name);

/// The mesh of this node alone. @throws InputError as node_named.
RawMesh mesh_of_node(const RawMesh& mesh, const std::string& name);
/// The same of an imported file, with the deflection of the node's own products.
ImportedMesh node_of(const ImportedMesh& whole, const std::string& name);

}  // namespace haptic::tools
