// SPDX-License-Identifier: Apache-2.0
#pragma once
/// How far the edges of a piece go on in the other pieces of its body. A cut that shortens an edge
/// leaves its vertex a neighbour that rises less over a contact plane than that of the uncut body
/// does; what rises counts in the weight of a contact (method section 8.2).

#include <span>

#include "rt_core/base/scalar.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic {

/// Of an edge: the distance from vertex[k] to where the edge ends in the uncut body, over the
/// length that the piece has of it; 1 or more.
struct EdgeReach {
  Real from[2] = {1, 1};
};

/// Fills `reach`, one entry per edge of every piece of the scene, in the order of the edge table.
/// An edge goes on in another piece of its body where both have the end in one point, which is no
/// vertex of the mesh, and the same two planes. Cost: the square of a body's edges times its
/// pieces; for the start, not for the loop.
void measure_edge_reach(const SceneView& scene, std::span<EdgeReach> reach) noexcept;

/// Edges of all pieces.
[[nodiscard]] std::uint32_t edge_count_of(const SceneView& scene) noexcept;

}  // namespace haptic
