// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Where faces of a surface with moved vertices no longer have a proper border.

#include <vector>

#include "tools/graph_compiler/polyhedron/flatten.hpp"

namespace haptic::tools {

/// Ends of edges of `merged` that run against their direction before the move, or that cross
/// another edge of the same face; ascending. A guess in double that spares attempts: the
/// certificate of the pieces decides.
/// @param before, after  the same faces; vertices before and after the move
/// Cost: quadratic in the edges of a face, sorted along one axis.
std::vector<std::uint32_t> crossing_vertices(const Surface& before, const Surface& after,
                                             const PlaneFit& fit, const MergedSurface& merged);

/// Corners of a body, local frame [m], at whose edges faces cross themselves although the guess
/// above found none: corners move onto their exact planes. In double, as above.
std::vector<Point3> crossing_places(const FlatBody& body);

}  // namespace haptic::tools
