// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Families of parts on which the decomposition is tested (tools/graph_compiler/METHOD.md section
/// 8).

#include "tests/tools/polyhedron/solid_builder.hpp"

namespace haptic::tools::test {

/// A general rotation, about 1 / size wide per unit.
AffineMap general_map(long size);

FlatBody l_prism(const AffineMap& map);
/// Plate of 10 000 units with one polygonal hole of n corners.
FlatBody plate_with_hole(std::size_t corners, const AffineMap& map);
/// Plate with k x k square holes in rows.
FlatBody plate_with_grid(int k, const AffineMap& map);
/// Plate with k x k square holes, each turned by its own angle.
FlatBody plate_with_turned_holes(int k, std::uint64_t seed, const AffineMap& map);
/// Cube of side 3 with a cubic cavity of side 1.
FlatBody hollow_cube(const AffineMap& map);
/// Union of 1 to 6 random boxes on a grid of up to 5 cells.
FlatBody random_boxes(std::uint64_t seed);
/// Random half of a grid of up to 4 cells: many solids that touch along edges and in corners.
FlatBody random_cells(std::uint64_t seed);

}  // namespace haptic::tools::test
