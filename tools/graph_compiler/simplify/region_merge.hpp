// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Fewer planes for the same surface: bevels, fillets and rounds give up their planes to their
/// neighbours, which are extended until they meet.

#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"
#include "tools/graph_compiler/polyhedron/plane_fit.hpp"

namespace haptic::tools {

/// Planes that replace those of a fit, and where the vertices go: each to the point of its planes
/// that is nearest to where it was. The faces stay, so does what is next to what.
struct MergedRegions {
  PlaneFit fit;
  std::vector<Point3> vertices;  ///< local [m], as many as the surface has
  std::size_t merges = 0;
};

/// Regions (connected faces on one plane) are united with a neighbour, cheapest first: the smaller
/// one takes the plane of the larger one, or two of like size take a new one. The cost is the
/// largest distance between old and new surface that the vertices concerned show; at most
/// `distance_m`, and nothing is united that would turn a face by more than 75 degrees or move a
/// vertex by more than a few times the distance: opposite walls stay apart, holes stay open.
/// `allowance_m` is the distance allowed at each vertex, at most `distance_m`.
/// A guess by vertices alone: the caller measures the distance. Deterministic.
/// Cost: O(n log n) unions, each with the vertices of two regions.
MergedRegions merge_regions(const Surface& surface, const FaceNeighbors& neighbors,
                            const PlaneFit& fit, double distance_m,
                            const std::vector<double>& allowance_m);

}  // namespace haptic::tools
