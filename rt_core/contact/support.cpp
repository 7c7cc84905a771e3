// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/support.hpp"

namespace haptic {

std::uint32_t highest_vertex(const PieceView& piece, const LanePoints& points, const Vec3& n,
                             std::uint32_t start) noexcept {
  if (piece.vertex_count <= kDenseVertices) return highest_point(points, n);
  std::uint32_t best = start;
  Real height = n.dot(points.at(best));
  for (std::uint32_t step = 0; step < kMaxClimbSteps; ++step) {
    const std::uint32_t from = best;
    for (const std::uint16_t e : piece.edges_at(from)) {
      const std::uint32_t next = piece.other_end(e, from);
      const Real h = n.dot(points.at(next));
      if (h > height) {
        height = h;
        best = next;
      }
    }
    if (best == from) return best;
  }
  return highest_point(points, n);
}

}  // namespace haptic
