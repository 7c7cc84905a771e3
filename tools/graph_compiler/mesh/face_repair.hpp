// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Repairs that look at single faces: loops that touch themselves, faces without area, faces given
/// twice.

#include "tools/graph_compiler/mesh/work_mesh.hpp"

namespace haptic::tools {

/// Splits loops that pass through a point twice into simple loops where all of these turn the same
/// way.
/// @throws InputError for a loop that crosses itself or has a hole bridged into it.
/// Cost: quadratic in the corners of one face; constant for triangles.
void split_touching_loops(WorkMesh& mesh);

/// Drops faces whose height over their longest extent is below a tenth of the tolerance. The
/// neighbours then meet along it with T-junctions, which stitch() closes.
void drop_degenerate_faces(WorkMesh& mesh);

/// Faces over the same corners: repetitions go. A pair of opposite faces is an inner wall between
/// two solids or a fin without thickness if its rim has an even number of other faces, and both go;
/// otherwise (a mesh whose faces are all given from both sides) one stays.
void drop_duplicate_faces(WorkMesh& mesh);

/// @throws InputError for loops of four and more corners whose edges cross by more than a tenth of
/// the tolerance.
void refuse_crossing_loops(const WorkMesh& mesh);

}  // namespace haptic::tools
