// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Points of a contact region in the contact plane, their convex hull H and the point of H closest
/// to the origin, which is pi(x_0^A) (paper Sec. IV; METHOD sections 5 and 8.2).

#include <cstdint>
#include <span>

#include "rt_core/base/plane_point.hpp"

namespace haptic {

/// Memory for one hull: room for twice the largest number of points of a patch.
struct HullScratch {
  std::span<PlanePoint> points;  ///< as many as the largest patch
  std::span<PlanePoint> hull;    ///< twice as many
};

/// Convex hull, counter-clockwise, strictly convex within `width_m`; sorts `points`. Returns its
/// size; `hull` has room for twice the points. Cost: O(K log K) of K points.
[[nodiscard]] std::uint32_t convex_hull(std::span<PlanePoint> points, std::span<PlanePoint> hull,
                                        Real width_m) noexcept;

/// The side of a convex polygon that the origin, pi(x_0^A), is nearest to: the paper's contact
/// frame has x along it.
struct NearestSide {
  PlanePoint axis;      ///< unit, counter-clockwise; a segment: from its first end to its second
  bool inside = false;  ///< the origin lies in the polygon; never in a segment
};
/// `hull`: two corners or more, counter-clockwise. At a corner both sides are equally near within
/// `width_m`: the one whose line is farther from the origin (METHOD section 6, row 10). Cost: a
/// root per side.
[[nodiscard]] NearestSide nearest_side(std::span<const PlanePoint> hull, Real width_m) noexcept;

/// The point of the convex hull of `points` (at least one, duplicates and collinear ones welcome)
/// that is closest to the origin; exactly the origin when that lies in the hull or within `width_m`
/// of it. No hull is built: the closest point so far, on a vertex or a side, is improved by the
/// point that lies farthest towards the origin, until there is none. Each pass shortens the
/// distance, so no side comes twice. Cost: K per pass; two to four passes as a rule, 11 at most on
/// 3 million sets of up to 100 points, never more than K + kSparePasses. [m]
[[nodiscard]] PlanePoint closest_of_hull(std::span<const PlanePoint> points, Real width_m) noexcept;

/// Passes of closest_of_hull beyond the number of points; what has been found by then is a point of
/// the hull.
inline constexpr std::uint32_t kSparePasses = 8;

}  // namespace haptic
