// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which face of the user's file each facet of a piece comes from.

#include "tools/graph_compiler/polyhedron/flatten.hpp"

namespace haptic::tools {

/// Sets ExactFace::source_face of every facet: the face of its solid that it shares area with, -1
/// if a cut made all of it. For messages and reports only, so sample points in double are enough.
void find_source_faces(const ExactWorld& world, const std::vector<FlatSolid>& solids,
                       std::vector<Solid>& pieces, const std::vector<std::uint32_t>& piece_solid);

}  // namespace haptic::tools
