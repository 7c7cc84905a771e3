// SPDX-License-Identifier: Apache-2.0
#pragma once
/// How far two triangles are apart, and by how much they overlap, in double. Triangles have an
/// area.

#include "tools/graph_compiler/surface/triangle_crossing.hpp"

namespace haptic::tools {

/// Distance of the nearest points; 0 where an edge of one passes through the other [m].
double triangle_distance_m(const TriangleCorners& s, const TriangleCorners& t);

/// Length of the shortest move that takes two triangles apart [m]; not above 0 where they are apart
/// or touch, within rounding.
double triangle_overlap_m(const TriangleCorners& s, const TriangleCorners& t);

}  // namespace haptic::tools
