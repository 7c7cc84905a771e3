// SPDX-License-Identifier: Apache-2.0
#include "rt_core/tracking/planar_hull.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace haptic {
std::uint32_t convex_hull(std::span<PlanePoint> points, std::span<PlanePoint> hull,
                          Real width_m) noexcept {
  // Andrew's monotone chain.
  const auto before = [](const PlanePoint& l, const PlanePoint& r) {
    return l.x < r.x || (l.x == r.x && l.y < r.y);
  };
  std::make_heap(points.begin(), points.end(), before);
  std::sort_heap(points.begin(), points.end(), before);
  const auto turns_left = [width_m](const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
    return cross(b - a, c - b) > width_m * norm(c - a);
  };
  const auto count = static_cast<std::uint32_t>(points.size());
  std::uint32_t size = 0;
  for (std::uint32_t k = 0; k < count; ++k) {  // lower chain
    while (size >= 2 && !turns_left(hull[size - 2], hull[size - 1], points[k])) --size;
    hull[size++] = points[k];
  }
  const std::uint32_t lower = size + 1;
  for (std::uint32_t k = count - 1; k-- > 0;) {  // upper chain
    while (size >= lower && !turns_left(hull[size - 2], hull[size - 1], points[k])) --size;
    hull[size++] = points[k];
  }
  return size - 1;
}

NearestSide nearest_side(std::span<const PlanePoint> hull, Real width_m) noexcept {
  const std::size_t count = hull.size();
  NearestSide found;
  if (count == 2) {  // edge-face: the contact edge
    const PlanePoint along = hull[1] - hull[0];
    const Real length = norm(along);
    found.axis = {along.x / length, along.y / length};
    return found;
  }
  found.inside = true;
  Real nearest = std::numeric_limits<Real>::max(), farthest_line = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const PlanePoint from = hull[k];
    const PlanePoint side = hull[k + 1 == count ? 0 : k + 1] - from;
    const Real length = norm(side);
    const PlanePoint unit{side.x / length, side.y / length};
    const PlanePoint to_pi{-from.x, -from.y};  // pi is the origin
    const Real line = -cross(unit, to_pi);     // > 0: pi outside this side
    found.inside = found.inside && line <= 0;
    const Real s = std::clamp(dot(unit, to_pi), Real{0}, length);
    const Real distance = norm({to_pi.x - s * unit.x, to_pi.y - s * unit.y});
    const bool tie = std::abs(distance - nearest) <= width_m;
    if (tie ? line > farthest_line : distance < nearest) {
      found.axis = unit;
      farthest_line = line;
      nearest = tie ? std::min(nearest, distance) : distance;
    }
  }
  return found;
}

}  // namespace haptic
