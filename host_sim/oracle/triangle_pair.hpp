// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Two triangles in space, judged from their corners alone: whether they meet (exact: signs of
/// determinants in long double behind a bound of their rounding, else as sums of parts without
/// rounding), how deep they cross, and how far they are apart. Nothing of rt_core is used.
/// Triangles must have an area; both sides of a triangle count alike.

#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include "host_sim/oracle/wide.hpp"

namespace haptic::sim {

using Triangle = std::array<WideVec, 3>;

/// Exact sign of the volume of the tetrahedron a, b, c, d, by the corners as they are given: +1
/// where a, b, c are seen from d in clockwise order, 0 where the four lie in a plane.
[[nodiscard]] int volume_sign(const WideVec& a, const WideVec& b, const WideVec& c,
                              const WideVec& d);
/// Exact: whether the corners lie on one line.
[[nodiscard]] bool has_no_area(const Triangle& t);
/// Exact: whether the closed triangles share a point.
[[nodiscard]] bool triangles_meet(const Triangle& a, const Triangle& b);
/// Smallest distance of two points of them; 0 where they meet.
[[nodiscard]] Wide triangle_distance(const Triangle& a, const Triangle& b);

/// The directions along which two triangles can be kept apart at best: of the normals (0, 1), of
/// the pairs of edges (2 to 10, 3 per edge of A), and in the planes, square to the edges of A (11
/// to 13) and of B (14 to 16). @return unit length, absent where the two edges are parallel.
inline constexpr int kTriangleDirections = 17;
[[nodiscard]] std::optional<WideVec> triangle_direction(const Triangle& a, const Triangle& b,
                                                        int direction);

/// Largest gap over those directions, taken both ways. Positive: the triangles are apart by at
/// least this. Negative: the shortest translation that takes them apart has this length.
struct TriangleGap {
  Wide gap_m = -std::numeric_limits<Wide>::infinity();
  int direction = 0;  ///< as of triangle_direction
  Wide sign = 1;      ///< sign * direction points from B to A
};
/// Stops at the first gap of at least `enough_m`; begins with direction `first`.
[[nodiscard]] TriangleGap triangle_gap(const Triangle& a, const Triangle& b, Wide enough_m,
                                       int first = 0);
/// Gap along a unit direction from B to A.
[[nodiscard]] Wide gap_along(const Triangle& a, const Triangle& b, const WideVec& normal);

}  // namespace haptic::sim
