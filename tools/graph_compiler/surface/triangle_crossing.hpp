// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Answers about triangles in double coordinates: on which side a point lies, whether two triangles
/// meet. A filter in double decides as a rule, else expansions of doubles (Shewchuk), exactly.

#include <array>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

using TriangleCorners = std::array<Point3, 3>;

/// Sign of (a - d) . ((b - d) x (c - d)): on which side of the plane through a, b, c the point d
/// lies, 0 on it. Exact unless a product underflows.
int side_of_plane(const Point3& a, const Point3& b, const Point3& c, const Point3& d);

/// An edge of one passes through the inside of the other, by more than doubles can be wrong:
/// neither touching nor overlap in a common plane counts.
bool triangles_cross(const TriangleCorners& s, const TriangleCorners& t);

/// The two have a point in common, touching included. Exact. Precondition: both have an
/// area.
bool triangles_meet(const TriangleCorners& s, const TriangleCorners& t);

/// Twice the area vector of a convex or simple polygon in one plane, as if in twice the precision:
/// its direction is right to rounding for a sliver too.
Point3 exact_twice_area(const Point3* corners, std::size_t count);

}  // namespace haptic::tools
