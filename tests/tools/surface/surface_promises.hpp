// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What must hold for every surface part, of any mesh.

#include <string>

#include "tools/graph_compiler/surface/surface_part.hpp"

namespace haptic::tools::test {

/// First violated promise of surface_part.hpp, empty if none: convex flat facets with unit normals,
/// each vertex in use and no two equal, sides, edges, rings and inward directions that fit them,
/// `closed` as the edges say. `size_m` is that of the part.
std::string broken_promise(const SurfacePart& part, double size_m);

/// Largest distance of points of one set from the other: corners, middles of sides and seeded
/// points of every triangle of the file against the facets, and of every facet against the
/// triangles.
double set_distance(const SurfacePart& part, const RawMesh& raw, double scale_to_m,
                    std::uint64_t seed);

}  // namespace haptic::tools::test
