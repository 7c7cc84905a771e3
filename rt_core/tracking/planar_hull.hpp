// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Points of a contact region in the contact plane, with pi(x_0^A) as the origin, their convex hull
/// H and its side nearest to it (paper Sec. IV; METHOD section 5).

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

}  // namespace haptic
