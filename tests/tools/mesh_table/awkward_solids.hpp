// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Builders of solids that the table writes in several formats.

#include <vector>

#include "tests/tools/mesh/mesh_builder.hpp"

namespace haptic::tools::test {

MeshBuilder box_mesh(const Point3& low, const Point3& high, bool outward = true);

/// Prism from z = 0 to z = `height` over a polygon (x, y), counter-clockwise; the caps are one
/// n-gon each, or fans around the origin.
MeshBuilder prism_mesh(const std::vector<Point3>& polygon, double height, bool fan_caps);

/// Regular points on the circle, joined in steps of `step`: 5 and 2 give the pentagram.
std::vector<Point3> star_polygon(std::size_t points, std::size_t step, double radius);
/// 2 n points at two radii in turn: n reflex edges in the prism.
std::vector<Point3> toothed_polygon(std::size_t teeth, double outer, double inner);

/// A strip of quads that closes after half a turn: open, one-sided.
MeshBuilder moebius_strip(std::uint32_t quads);
/// The Klein bottle in three dimensions, as triangles: closed, one-sided, through itself.
MeshBuilder klein_bottle();
/// 3 x 3 x 1 with a square hole of 1 x 1, quads only.
MeshBuilder square_ring();

}  // namespace haptic::tools::test
