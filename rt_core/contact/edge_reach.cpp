// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/edge_reach.hpp"

#include "rt_core/contact/uncut_edges.hpp"

namespace haptic {

void measure_edge_reach(const SceneView& scene, std::span<EdgeReach> reach) noexcept {
  const auto piece_at = [&](std::uint32_t p) noexcept { return scene.piece(p); };
  for (const BodyRecord& body : scene.bodies()) UncutEdges(body, piece_at).measure(reach);
}

std::uint32_t edge_count_of(const SceneView& scene) noexcept {
  std::uint32_t count = 0;
  for (const PieceRecord& piece : scene.pieces()) count += piece.edge_count;
  return count;
}

}  // namespace haptic
