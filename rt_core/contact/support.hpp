// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Support vertices of the two convex pieces of a pair. Exact: a linear function on a convex
/// polyhedron has no local maximum but the global one, so a climb from vertex to vertex ends at the
/// support; small pieces are searched whole, which takes no longer and has no branches.

#include "rt_core/contact/pair_pose.hpp"

namespace haptic {

/// Pieces with at most this many vertices are searched whole.
inline constexpr std::uint32_t kDenseVertices = 24;
/// Steps of a climb, after which the piece is searched whole: bounds the worst case.
inline constexpr std::uint32_t kMaxClimbSteps = 16;

/// Vertex with the largest n.p of `piece`, whose vertices are `points` in any axes; climbs from
/// `start`. Cost: kMaxClimbSteps vertex stars and one pass over the vertices, at most.
[[nodiscard]] std::uint32_t highest_vertex(const PieceView& piece, const LanePoints& points,
                                           const Vec3& n, std::uint32_t start) noexcept;

/// The same of its vertices in its own geometry frame.
[[nodiscard]] std::uint32_t highest_vertex(const PieceView& piece, const Vec3& n,
                                           std::uint32_t start) noexcept;

/// Vertex of A with the smallest n.(R a).
[[nodiscard]] inline std::uint32_t lowest_vertex_a(const PairPose& pose, const Vec3& n_w,
                                                   std::uint32_t start) noexcept {
  return highest_vertex(pose.pair->a, pose.points_a_w, -n_w, start);
}

/// Vertex of B with the largest n.b.
[[nodiscard]] inline std::uint32_t highest_vertex_b(const PairPose& pose, const Vec3& n_w,
                                                    std::uint32_t start) noexcept {
  return highest_vertex(pose.pair->b, n_w, start);
}

/// Support vertices of both pieces for one direction; kept from tick to tick as starts of the next
/// climb.
struct SupportPair {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
};

[[nodiscard]] inline SupportPair support_pair(const PairPose& pose, const Vec3& n_w,
                                              SupportPair start) noexcept {
  return {lowest_vertex_a(pose, n_w, start.a), highest_vertex_b(pose, n_w, start.b)};
}

/// Signed gap along the unit direction n between the two pieces: n.x - h(n) of METHOD section 1, h
/// the support function of the C-obstacle. For every unit n a lower bound of the signed distance.
/// [m]
[[nodiscard]] inline Real gap_along(const PairPose& pose, const Vec3& n_w, SupportPair s) noexcept {
  return n_w.dot((pose.y_w - pose.vertex_b(s.b)) + pose.vertex_a(s.a));
}

}  // namespace haptic
