// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Boundary of the union of convex bodies, for pictures of bodies that overlap (C-obstacles of the
/// pieces of one body do).

#include "host_sim/lab/studies/reproduction/drawing.hpp"

namespace haptic::sim {

/// Replaces the faces of each body by convex fragments of them that lie outside all the others.
/// Cost: faces times bodies times faces.
void cut_to_union(std::span<PaintedBody> bodies);

}  // namespace haptic::sim
