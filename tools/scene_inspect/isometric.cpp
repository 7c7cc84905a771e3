// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/isometric.hpp"

#include <algorithm>
#include <cmath>

#include "tools/common/formatted.hpp"
#include "tools/scene_facts/coupling_text.hpp"

namespace haptic::tools {

Polygon2 Isometric::at(const std::vector<Point3>& loop) const {
  Polygon2 polygon;
  for (const Point3& p : loop) polygon.push_back(at(p));
  return polygon;
}

Isometric fitted_view(const std::vector<Point3>& points, Pixel corner, double width,
                      double height) {
  Isometric view;
  Pixel low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
  for (const Point3& point : points) {
    const Pixel p = view.at(point);
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  view.scale =
      std::min(width / std::max(high.x - low.x, 1e-300), height / std::max(high.y - low.y, 1e-300));
  view.origin = {corner.x + width / 2 - view.scale * (low.x + high.x) / 2,
                 corner.y + height / 2 - view.scale * (low.y + high.y) / 2};
  return view;
}

std::string rgb(const std::array<double, 3>& colour, double shade) {
  int c[3];
  for (std::size_t k = 0; k < 3; ++k) {
    c[k] = static_cast<int>(std::lround(255.0 * std::clamp(colour[k] * shade, 0.0, 1.0)));
  }
  return formatted("#%02x%02x%02x", c[0], c[1], c[2]);
}

double shade_of(const Point3& normal) {
  const Point3 light = vec::unit({0.25, -0.75, 1.2});
  return 0.66 + 0.44 * std::max(0.0, vec::dot(normal, light));
}

bool holds(const Polygon2& polygon, const Pixel& p) {
  bool inside = false;
  for (std::size_t i = 0, k = polygon.size() - 1; i < polygon.size(); k = i++) {
    const Pixel &a = polygon[i], &b = polygon[k];
    if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)) {
      inside = !inside;
    }
  }
  return inside;
}

Pixel middle_of(const Polygon2& polygon) {
  Pixel sum;
  for (const Pixel& p : polygon) sum = {sum.x + p.x, sum.y + p.y};
  const auto n = static_cast<double>(polygon.size());
  return {sum.x / n, sum.y / n};
}

double distance_to(const Polygon2& polygon, const Pixel& p) {
  double nearest = HUGE_VAL;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Pixel &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double dx = b.x - a.x, dy = b.y - a.y, square = dx * dx + dy * dy;
    const double share =
        square > 0 ? std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy) / square, 0.0, 1.0) : 0.0;
    nearest = std::min(nearest, std::hypot(p.x - a.x - share * dx, p.y - a.y - share * dy));
  }
  return nearest;
}

std::string scale_svg(const Isometric& view, Pixel at, double wanted) {
  const double metres = wanted / view.scale;
  const double power = std::pow(10.0, std::floor(std::log10(metres)));
  const double length_m = power * (metres / power >= 5 ? 5 : metres / power >= 2 ? 2 : 1);
  return formatted("<path d=\"M%.1f %.1fv-6v3h%.2fv-3v6\" fill=\"none\" stroke=\"#222\"/>\n", at.x,
                   at.y, view.scale * length_m) +
         text_at(at.x + view.scale * length_m + 8, at.y + 1, short_length(length_m), "start", 12);
}

std::string seam_pattern(const std::array<double, 3>& colour) {
  return "<defs><pattern id=\"seam\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" "
         "patternTransform=\"rotate(45)\"><rect width=\"2\" height=\"6\" fill=\"" +
         rgb(colour, 1.0) + "\"/></pattern></defs>\n";
}

}  // namespace haptic::tools
