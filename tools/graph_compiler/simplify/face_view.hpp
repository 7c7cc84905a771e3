// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A face seen along its normal: two coordinates, and whether segments there cross.

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

struct ViewPoint {
  double x = 0.0, y = 0.0;
  bool operator==(const ViewPoint&) const = default;
};

/// The view along the axis that the outward normal is nearest to; counter-clockwise stays so.
class FaceView {
 public:
  explicit FaceView(const Point3& normal) {
    std::size_t drop = 0;
    for (std::size_t i = 1; i < 3; ++i) {
      if (std::abs(normal[i]) > std::abs(normal[drop])) drop = i;
    }
    x_ = (drop + 1) % 3;
    y_ = (drop + 2) % 3;
    if (normal[drop] < 0.0) std::swap(x_, y_);
  }
  [[nodiscard]] ViewPoint of(const Point3& p) const { return {p[x_], p[y_]}; }

 private:
  std::size_t x_ = 0, y_ = 1;
};

/// Twice the area of the triangle: positive where a, b, c run counter-clockwise.
inline double turn(const ViewPoint& a, const ViewPoint& b, const ViewPoint& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Segments ab and cd that share more than an end of both; touching counts.
inline bool segments_cross(const ViewPoint& a, const ViewPoint& b, const ViewPoint& c,
                           const ViewPoint& d) {
  const double ac = turn(a, b, c), ad = turn(a, b, d);
  const double ca = turn(c, d, a), cb = turn(c, d, b);
  if ((ac > 0 && ad > 0) || (ac < 0 && ad < 0) || (ca > 0 && cb > 0) || (ca < 0 && cb < 0)) {
    return false;
  }
  const auto within = [](const ViewPoint& p, const ViewPoint& q, const ViewPoint& r) {
    return std::min(p.x, q.x) <= r.x && r.x <= std::max(p.x, q.x) && std::min(p.y, q.y) <= r.y &&
           r.y <= std::max(p.y, q.y) && !(p == r) && !(q == r);
  };
  const bool proper = ac != 0 && ad != 0 && ca != 0 && cb != 0;
  return proper || (ac == 0 && within(a, b, c)) || (ad == 0 && within(a, b, d)) ||
         (ca == 0 && within(c, d, a)) || (cb == 0 && within(c, d, b));
}

}  // namespace haptic::tools
