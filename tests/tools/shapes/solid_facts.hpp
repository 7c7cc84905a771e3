// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What holds for the mesh of a solid: closedness, genus, volume, symmetry.

#include <string>

#include "tools/graph_compiler/shapes/shape.hpp"

namespace haptic::tools::test {

/// First defect, empty if none: corners in range and all used, no place twice, no corner twice in a
/// face, each edge once in both directions, faces flat to `flat_m`, no face without area.
std::string closed_defect(const RawMesh& mesh, double flat_m);
/// Vertices - edges + faces: 2 for a ball, 0 for a ring.
long euler_characteristic(const RawMesh& mesh);
/// Positive when the faces look outwards.
double volume_m3(const RawMesh& mesh);
/// True when the corners, each coordinate times that of `signs`, are the same set, bit for bit.
bool is_symmetric(const RawMesh& mesh, const Point3& signs);

}  // namespace haptic::tools::test
