// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Plane polygons with holes cut into triangles, so that distances between surfaces can be bounded
/// triangle by triangle.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/polyhedron/flatten.hpp"

namespace haptic::tools {

using FaceTriangle = std::array<Point3, 3>;

inline vec::Box box_of(const FaceTriangle& t) {
  vec::Box box;
  for (const Point3& p : t) box.include(p);
  return box;
}

/// Triangles of one face: closed loops of corners in a plane with this outward normal, outer loops
/// counter-clockwise seen along it, holes clockwise. Corners may repeat (loops that touch).
/// Appended to `out`. Returns false, with nothing appended, where the loops are no border of an
/// area: the triangles must all have the face's orientation and the face's area.
/// Cost: quadratic in corners, as a rule.
bool triangulate_face(const std::vector<std::vector<Point3>>& loops, const Point3& normal,
                      std::vector<FaceTriangle>& out);

/// Triangles of a cleaned surface, local frame [m]. A polygon that is bent, so that no plane shows
/// it whole, comes as a fan.
std::vector<FaceTriangle> triangles_of(const Surface& surface);

/// Triangles of the boundary of a body, local frame [m].
/// @throws InputError naming `file` where a face is no area: the boundary crosses itself.
std::vector<FaceTriangle> triangles_of(FlatBody& body, const std::string& file);

}  // namespace haptic::tools
