// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/support.hpp"

namespace haptic {
namespace {

/// Steepest climb of sign * n.v over the vertex graph; `vertices` holds 3 Reals per vertex. Each
/// step strictly rises, so no vertex comes twice and the count bounds the steps.
std::uint32_t climb(const PieceView& piece, const Real* vertices, const Vec3& n, Real sign,
                    std::uint32_t start) noexcept {
  const Vec3 direction = sign * n;
  std::uint32_t best = start;
  Real height = direction.dot(ConstVec3Map(vertices + 3 * std::size_t{best}));
  for (std::uint32_t step = 0; step < piece.vertex_count; ++step) {
    const std::uint32_t from = best;
    for (const std::uint16_t e : piece.edges_at(from)) {
      const std::uint32_t next = piece.other_end(e, from);
      const Real h = direction.dot(ConstVec3Map(vertices + 3 * std::size_t{next}));
      if (h > height) {
        height = h;
        best = next;
      }
    }
    if (best == from) break;
  }
  return best;
}

}  // namespace

std::uint32_t lowest_vertex_a(const PairPose& pose, const Vec3& n_w, std::uint32_t start) noexcept {
  return climb(pose.pair->a, pose.vertices_w, n_w, -1.0_r, start);
}

std::uint32_t highest_vertex_b(const PairPose& pose, const Vec3& n_w,
                               std::uint32_t start) noexcept {
  return climb(pose.pair->b, pose.pair->b.vertices, n_w, 1.0_r, start);
}

SupportPair support_pair(const PairPose& pose, const Vec3& n_w, SupportPair start) noexcept {
  return {lowest_vertex_a(pose, n_w, start.a), highest_vertex_b(pose, n_w, start.b)};
}

}  // namespace haptic
