// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Points and planes in double: the point of several planes that is nearest to a given one, and the
/// plane in the middle of many points.

#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

/// normal . x = offset, normal of unit length.
struct HessePlane {
  Point3 normal{0, 0, 0};
  double offset = 0.0;
};

struct PlaneCorner {
  bool found = false;  ///< false: planes that meet at an angle too small to place a point
  Point3 point{0, 0, 0};
  double residual = 0.0;  ///< largest distance of the point from a plane: more than three planes
};

/// Foot of the perpendicular on one plane or on the line of two, the common point of three, the
/// least-squares point of more; where planes leave a direction open, the move along it is zero.
PlaneCorner nearest_corner(const std::vector<HessePlane>& planes, const Point3& from);

/// Least-squares plane of the points `which`, oriented like `like`, moved along its normal to the
/// middle between the outermost points.
HessePlane middle_plane(const std::vector<Point3>& all, const std::vector<std::uint32_t>& which,
                        const Point3& like);

}  // namespace haptic::tools
