// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which faces, edges and vertices of the pieces of one body lie on its surface, and with which
/// normals: at every point the normal cones of all pieces that contain it are intersected
/// (METHOD section 11, "Seams"; rt_core/METHOD.md section 10). Planes and vertices are the exact
/// ones, so containment is decided without a tolerance; only the cones of vertices are weighed in
/// double.

#include <vector>

#include "tools/graph_compiler/graph/pruning_marks.hpp"
#include "tools/graph_compiler/polyhedron/flatten.hpp"

namespace haptic::tools {

/// Cones of directions thinner than this [rad] count as closed: they hold no direction that a
/// contact could keep.
inline constexpr double kThinnestCone_rad = 1.0e-9;

/// Exposure of every piece of a body, in the order of `pieces`; features numbered as by
/// build_topology of what to_body makes of the piece. The pieces may overlap (a cover). Leftovers
/// of lower dimension (a seam within a flat face, a corner that a cut puts on an edge) are hidden:
/// they repeat planes and points of the uncut part. Coordinates in the frame of to_body.
/// Cost: piece pairs whose boxes meet times their faces times vertices, signs mostly filtered.
/// @throws BrokenChain when a facet is not one loop.
std::vector<PieceExposure> exposure_of(const FlatBody& body, const std::vector<Solid>& pieces);

}  // namespace haptic::tools
