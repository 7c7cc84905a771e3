// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Checks of what the compiler derives from the vertices and faces of a piece: padded lanes, arcs
/// of the edges on the Gauss sphere, sides of a facet, bounds of the search. Only called on a piece
/// whose indices and planes have passed. Each answers kOk or kBlobBadNumber.

#include "rt_core/base/status.hpp"
#include "rt_core/scene/scene_check.hpp"

namespace haptic::check {

/// The share of epsilon by which the compiler lets a vertex rise higher than the apex of an arc and
/// still says that the apex rules: equal heights differ by rounding of the mesh. A share, because
/// an absolute height would refuse small parts that pass when they are larger.
inline constexpr double kApexSlack = 1.0e-9;

/// The lanes are the vertices, bit for bit; the padding repeats vertex 0. Cost: O(V).
[[nodiscard]] RtStatus lanes(const PieceView& p) noexcept;

/// Every arc is that of its edge within rounding: orthonormal, orthogonal to the edge, ends where
/// the adjoining face rises by `epsilon_m` over a plane through the edge; full where one cannot.
/// `scale` is the largest coordinate [m]. Cost: O(E).
[[nodiscard]] RtStatus arcs(const PieceView& p, double scale, double epsilon_m) noexcept;

/// The normal of every side of a facet is unit, in its plane, orthogonal to the edge and out of it,
/// within rounding. Cost: O(E).
[[nodiscard]] RtStatus sides(const PieceView& p) noexcept;

/// Reach and relaxations of the record are in their ranges. Relaxations are bounds that take the
/// compiler seconds; here they are only held to what any piece can have. Cost: O(V).
[[nodiscard]] RtStatus bounds(const PieceView& p, double scale, double epsilon_m) noexcept;

}  // namespace haptic::check
