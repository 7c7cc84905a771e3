// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/support.hpp"

namespace haptic {
namespace {

/// Steps of a climb after which it begins again from the highest of so many vertices.
constexpr std::uint32_t kNearSteps = 3, kClimbSamples = 16;
static_assert(kClimbSamples <= kDenseVertices && kNearSteps < kMaxClimbSteps);

/// Vertices of a facet as points.
struct FacetPoints {
  const PieceView& facet;

  [[nodiscard]] ConstVec3Map at(std::uint32_t v) const noexcept { return facet.vertex(v); }
};

/// The first of the highest, by the sums of the search over lanes.
std::uint32_t highest_point(const FacetPoints& points, const Vec3& n) noexcept {
  const auto height_of = [&](std::uint32_t v) {
    const ConstVec3Map p = points.at(v);
    return (p[0] * n[0] + p[1] * n[1]) + p[2] * n[2];
  };
  std::uint32_t best = 0;
  Real height = height_of(0);
  for (std::uint32_t v = 1; v < points.facet.vertex_count; ++v) {
    const Real h = height_of(v);
    if (!(h > height)) continue;
    height = h;
    best = v;
  }
  return best;
}

/// Inside both callers: a call more would cost a fifth of a small piece's search.
template <typename Points>
[[gnu::always_inline]] inline std::uint32_t highest_of(const PieceView& piece, const Points& points,
                                                       const Vec3& n,
                                                       std::uint32_t start) noexcept {
  if (piece.vertex_count <= kDenseVertices) return highest_point(points, n);
  std::uint32_t best = start;
  Real height = n.dot(points.at(best));
  for (std::uint32_t step = 0; step < kMaxClimbSteps; ++step) {
    if (step == kNearSteps) {
      // The start was far off: the highest of some vertices all over the piece may be nearer.
      const std::uint32_t stride = piece.vertex_count / kClimbSamples;
      for (std::uint32_t k = 0, v = 0; k < kClimbSamples; ++k, v += stride) {
        const Real h = n.dot(points.at(v));
        if (!(h > height)) continue;
        height = h;
        best = v;
      }
    }
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

}  // namespace

std::uint32_t highest_vertex(const PieceView& piece, const LanePoints& points, const Vec3& n,
                             std::uint32_t start) noexcept {
  return highest_of(piece, points, n, start);
}

std::uint32_t highest_vertex(const PieceView& piece, const Vec3& n, std::uint32_t start) noexcept {
  return piece.is_facet() ? highest_of(piece, FacetPoints{piece}, n, start)
                          : highest_of(piece, lane_points(piece), n, start);
}

}  // namespace haptic
