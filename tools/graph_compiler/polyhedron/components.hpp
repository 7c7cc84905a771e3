// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Connected parts of a boundary (METHOD section 4, "components").

#include "tools/graph_compiler/polyhedron/chain.hpp"

namespace haptic::tools {

/// Separates a closed boundary into solids that share no edge: union-find over the loops of its
/// faces, joined across edges and from holes to the outer loops around them. Inward shells (voids)
/// go to the smallest solid around them. Boundaries that touch in a vertex or along an edge only
/// come out apart. Result canonical, in a fixed order.
/// @throws BrokenChain if the boundary is not closed.
std::vector<Solid> components(ExactWorld& world, const Solid& boundary);

/// True if every edge of the solid is met by as many edges in the opposite direction.
bool is_closed(const Solid& solid);

}  // namespace haptic::tools
