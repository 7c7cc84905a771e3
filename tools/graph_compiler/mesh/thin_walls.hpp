// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Finds walls that the plane tolerance would destroy.

#include <vector>

#include "tools/graph_compiler/mesh/work_mesh.hpp"

namespace haptic::tools {

/// A wall or gap thinner than this many tolerances is no longer safe: planes that far apart could
/// be united or lose their order when corners are moved onto them.
inline constexpr double kThinnestWallInTolerances = 10.0;

/// Looks from each vertex for a face of the same shell that is opposite to one at the vertex
/// (normals more than 143 degrees apart) and nearer than ten tolerances. Faces narrower than 20
/// tolerances are noise and do not count. Nearly coincident parallel faces of different shells are
/// listed in mesh.close_faces; narrow gaps are warnings. Cost: O(V log F); stops after a fixed
/// number of comparisons, with a warning.
/// @throws InputError "thinner than the plane tolerance ..." with the place.
void check_thin_walls(WorkMesh& mesh, const std::vector<std::uint32_t>& shell_of_face);

}  // namespace haptic::tools
