// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The view of the drawing of C-space: orthographic from (1, -1, 1), z upward.

#include <array>
#include <string>
#include <vector>

#include "tools/common/svg.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {

using Polygon2 = std::vector<Pixel>;

struct Isometric {
  Point3 viewer = vec::unit({1, -1, 1});
  Point3 right = vec::unit({1, 1, 0});
  Point3 up = vec::cross(viewer, right);
  double scale = 1.0;  ///< drawing units per metre
  Pixel origin;
  [[nodiscard]] Pixel at(const Point3& p) const {
    return {origin.x + scale * vec::dot(p, right), origin.y - scale * vec::dot(p, up)};
  }
  [[nodiscard]] Polygon2 at(const std::vector<Point3>& loop) const;
};

/// A view in which all of `points` lie in the panel.
[[nodiscard]] Isometric fitted_view(const std::vector<Point3>& points, Pixel corner, double width,
                                    double height);

/// "#rrggbb" of a colour with components from 0 to 1.
[[nodiscard]] std::string rgb(const std::array<double, 3>& colour, double shade);
/// Light from above and from the left, so that the three faces of a box differ.
[[nodiscard]] double shade_of(const Point3& normal);

[[nodiscard]] Pixel middle_of(const Polygon2& polygon);
[[nodiscard]] bool holds(const Polygon2& polygon, const Pixel& p);
/// Distance from a point to the outline of a polygon.
[[nodiscard]] double distance_to(const Polygon2& polygon, const Pixel& p);

/// A bar of 1, 2 or 5 times a power of ten, about `wanted` wide, its left end at `at`.
[[nodiscard]] std::string scale_svg(const Isometric& view, Pixel at, double wanted);

/// Stripes at 45 degrees, `url(#seam)`.
[[nodiscard]] std::string seam_pattern(const std::array<double, 3>& colour);

}  // namespace haptic::tools
