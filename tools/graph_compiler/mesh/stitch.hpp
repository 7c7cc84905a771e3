// SPDX-License-Identifier: Apache-2.0
#pragma once
/// T-junctions and open edges (METHOD section 3, step 2).

#include "tools/graph_compiler/mesh/work_mesh.hpp"

namespace haptic::tools {

/// Inserts, into open edges only, the ends of other open edges of the same part that lie within the
/// tolerance of them, sorted along the edge; repeats until nothing is left to insert. No vertex
/// moves. Cost: O(n log n) per round; the rounds end because a face takes each vertex once.
void stitch_t_junctions(WorkMesh& mesh);

/// @throws InputError naming the number of edges with one face and the longest chain of them.
void refuse_open_edges(const WorkMesh& mesh);

}  // namespace haptic::tools
