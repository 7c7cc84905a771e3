// SPDX-License-Identifier: Apache-2.0
#pragma once
/// From a closed set of faces to shells: pairing at edges with more than two faces, orientation,
/// splitting of touching solids (METHOD section 3, step 3).

#include <cstdint>
#include <vector>

#include "tools/graph_compiler/mesh/work_mesh.hpp"

namespace haptic::tools {

/// A set of faces with exactly two of opposite direction at each edge, a disc around each vertex.
struct WorkShell {
  std::vector<std::uint32_t> faces;  ///< indices into WorkMesh::faces, ascending
  double volume = 0.0;               ///< signed [m^3]; negative: faces point inward
};

/// Orients the faces of `mesh` consistently and splits it into shells. Points where several shells,
/// or several sheets of one shell, meet are repeated so that each sheet has its own. Shells are in
/// the order of their first faces. The sign of the volume is that of the whole set of touching
/// shells; nesting decides the final one. `flipped` (one entry per face, 1: against the file) tells
/// what was turned. Precondition: every edge has at least two faces (refuse_open_edges).
/// @throws InputError for edges with an odd number of faces, or an even one that does not
/// alternate, and for one-sided surfaces. Cost: O(n log n).
std::vector<WorkShell> build_shells(WorkMesh& mesh, std::vector<std::uint8_t>& flipped);

/// Reverses the loops of a shell.
void turn_shell(WorkMesh& mesh, WorkShell& shell, std::vector<std::uint8_t>& flipped);

}  // namespace haptic::tools
