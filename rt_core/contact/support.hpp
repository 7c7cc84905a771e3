// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Support vertices of the two convex pieces of a pair, by climbing from vertex to vertex. Exact: a
/// linear function on a convex polyhedron has no local maximum but the global one.

#include "rt_core/contact/pair_pose.hpp"

namespace haptic {

/// Vertex of A with the smallest n.(R a), climbing from `start`. Cost: at most one visit per
/// vertex.
[[nodiscard]] std::uint32_t lowest_vertex_a(const PairPose& pose, const Vec3& n_w,
                                            std::uint32_t start) noexcept;

/// Vertex of B with the largest n.b, climbing from `start`. Cost: at most one visit per vertex.
[[nodiscard]] std::uint32_t highest_vertex_b(const PairPose& pose, const Vec3& n_w,
                                             std::uint32_t start) noexcept;

/// Support vertices of both pieces for one direction; kept from tick to tick as starts of the next
/// climb.
struct SupportPair {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
};

[[nodiscard]] SupportPair support_pair(const PairPose& pose, const Vec3& n_w,
                                       SupportPair start) noexcept;

/// Signed gap along the unit direction n between the two pieces: n.x - h(n) of method section 1, h
/// the support function of the C-obstacle. For every unit n a lower bound of the signed distance.
/// [m]
[[nodiscard]] inline Real gap_along(const PairPose& pose, const Vec3& n_w, SupportPair s) noexcept {
  return n_w.dot((pose.y_w - pose.vertex_b(s.b)) + pose.vertex_a(s.a));
}

}  // namespace haptic
