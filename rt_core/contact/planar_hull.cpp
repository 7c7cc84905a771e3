// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/planar_hull.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace haptic {
namespace {

/// The point of segment (a, b) closest to the origin, and which of its ends carry it.
struct SegmentFoot {
  PlanePoint point;
  Real distance2 = 0;
  bool needs_a = true, needs_b = true;
};

SegmentFoot foot_on(const PlanePoint& a, const PlanePoint& b) noexcept {
  const PlanePoint side = b - a;
  const Real towards_b = -dot(a, side);
  const Real towards_a = dot(b, side);
  SegmentFoot foot;
  if (towards_b <= 0) {
    foot.point = a;
    foot.needs_b = false;
  } else if (towards_a <= 0) {
    foot.point = b;
    foot.needs_a = false;
  } else {
    const Real share = towards_b / (towards_a + towards_b);
    // From the nearer end: its rounding is that of a short way.
    foot.point = share < 0.5_r ? PlanePoint{a.x + share * side.x, a.y + share * side.y}
                               : PlanePoint{b.x - (1 - share) * side.x, b.y - (1 - share) * side.y};
  }
  foot.distance2 = dot(foot.point, foot.point);
  return foot;
}

/// Whether the origin lies in the triangle; a triangle without area has no inside.
bool surrounds_origin(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) noexcept {
  const Real ab = cross(a, b), bc = cross(b, c), ca = cross(c, a);
  const Real least = std::min({ab, bc, ca}), largest = std::max({ab, bc, ca});
  return (least >= 0 && largest > 0) || (largest <= 0 && least < 0);
}

std::size_t closest_point(std::span<const PlanePoint> points) noexcept {
  std::size_t closest = 0;
  Real least = dot(points[0], points[0]);
  for (std::size_t k = 1; k < points.size(); ++k) {
    const Real distance2 = dot(points[k], points[k]);
    if (distance2 < least) {
      least = distance2;
      closest = k;
    }
  }
  return closest;
}

}  // namespace

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

PlanePoint closest_of_hull(std::span<const PlanePoint> points, Real width_m) noexcept {
  constexpr Real kAngle = 4 * kRealEpsilon;  // rounding of the cosine below
  constexpr std::uint32_t kIdlePasses = 3;
  std::size_t a = closest_point(points), b = a;
  SegmentFoot foot{points[a], dot(points[a], points[a])};
  const std::size_t passes = points.size() + kSparePasses;
  std::uint32_t idle = 0;
  for (std::size_t pass = 0; pass < passes; ++pass) {
    if (foot.distance2 <= width_m * width_m) return {0, 0};
    // The part on the origin's side of the line through the foot, square to its direction:
    // differences first, so that the test is as sharp as the points are close.
    std::size_t s = a;
    Real farthest = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Real height = dot(foot.point, points[k] - foot.point);
      if (height < farthest && k != a && k != b) {
        farthest = height;
        s = k;
      }
    }
    if (s == a) break;
    const PlanePoint way = points[s] - foot.point;
    if (farthest * farthest <= kAngle * kAngle * foot.distance2 * dot(way, way)) break;
    SegmentFoot next = foot_on(points[a], points[s]);
    std::size_t end = a;
    if (a != b) {
      if (surrounds_origin(points[a], points[b], points[s])) return {0, 0};
      const SegmentFoot other = foot_on(points[b], points[s]);
      if (other.distance2 < next.distance2) {
        next = other;
        end = b;
      }
    }
    // The square of the distance is blind to a step along the side of less than the root of the
    // rounding, which the test above sees: such steps are taken, but not for ever.
    idle = next.distance2 < foot.distance2 ? 0 : idle + 1;
    if (idle > kIdlePasses || next.distance2 > (1 + kAngle) * foot.distance2) break;
    foot = next;
    a = next.needs_a ? end : s;
    b = next.needs_b ? s : end;
  }
  return foot.point;
}

}  // namespace haptic
