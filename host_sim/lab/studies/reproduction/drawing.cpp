// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/reproduction/drawing.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace haptic::sim {
namespace {

/// Colour of a face by its angle to a light over the viewer's left shoulder.
std::string shade(const Paint& paint, const Vector& normal, const Camera& camera) {
  const Vector light = (camera.toward_viewer() + Vector(-0.3, -0.2, 0.9)).normalized();
  const double brightness = 0.62 + 0.38 * std::max(0.0, normal.dot(light));
  char buffer[8];
  std::snprintf(buffer, sizeof buffer, "#%02x%02x%02x",
                static_cast<unsigned>(std::lround(brightness * paint.red)),
                static_cast<unsigned>(std::lround(brightness * paint.green)),
                static_cast<unsigned>(std::lround(brightness * paint.blue)));
  return buffer;
}

std::vector<Pixel> projected(const Camera& camera, const std::vector<Vector>& polygon) {
  std::vector<Pixel> points;
  for (const Vector& p : polygon) points.push_back(camera.project(p));
  return points;
}

void draw_front(SvgPage& page, const Camera& camera, const Facet& facet, const Paint& paint) {
  page.polygon(projected(camera, facet.polygon),
               facet.lit ? kLitColour : shade(paint, facet.normal, camera),
               facet.lit ? std::max(paint.opacity, 0.85) : paint.opacity, paint.edge_colour,
               paint.edge_width, facet.lit ? "near" : "front");
}

void draw_back(SvgPage& page, const Camera& camera, const Facet& facet, const Paint& paint) {
  const std::vector<Pixel> points = projected(camera, facet.polygon);
  if (paint.opacity < 1.0) {
    page.polygon(points, facet.lit ? kLitColour : shade(paint, -facet.normal, camera),
                 facet.lit ? 0.6 : 0.5 * paint.opacity, "none", 0, facet.lit ? "near" : "hidden");
  }
  if (!paint.hidden_edges) return;
  for (std::size_t k = 0; k < points.size(); ++k)
    page.line(points[k], points[(k + 1) % points.size()], "#909090", 0.7, true);
}

bool faces_viewer(const Facet& facet, const Camera& camera) {
  return facet.normal.dot(camera.toward_viewer()) > 0;
}

}  // namespace

Camera::Camera(const Vector& toward_viewer, const Vector& up, const Vector& centre,
               Pixel page_centre, double pixels_per_m)
    : toward_(toward_viewer.normalized()),
      right_(up.cross(toward_).normalized()),
      up_(toward_.cross(right_)),
      centre_(centre),
      page_(page_centre),
      scale_(pixels_per_m) {}

Pixel Camera::project(const Vector& p) const {
  const Vector d = p - centre_;
  return {page_.x + scale_ * right_.dot(d), page_.y - scale_ * up_.dot(d)};
}

std::vector<Facet> facets_of(const Solid& solid, const Vector& p, const Rotation& q) {
  std::vector<Facet> facets;
  for (const auto& loop : solid.loops) {
    Facet facet;
    for (const std::uint32_t v : loop) facet.polygon.emplace_back(p + q * solid.vertices[v]);
    facet.normal = (facet.polygon[1] - facet.polygon[0])
                       .cross(facet.polygon[2] - facet.polygon[0])
                       .normalized();
    facets.push_back(std::move(facet));
  }
  return facets;
}

std::vector<Facet> facets_of(const CObstacle& obstacle, std::span<const std::uint32_t> near) {
  std::vector<Facet> facets;
  for (const CFace& face : obstacle.faces) {
    const bool lit = std::any_of(near.begin(), near.end(), [&](std::uint32_t node) {
      return std::binary_search(face.nodes.begin(), face.nodes.end(), node);
    });
    if (face.polygon.size() >= 3) facets.push_back({face.polygon, face.normal, lit});
  }
  return facets;
}

void draw_body(SvgPage& page, const Camera& camera, std::span<const Facet> facets,
               const Paint& paint) {
  for (const Facet& facet : facets) {
    if (!faces_viewer(facet, camera) && paint.opacity < 1.0) draw_back(page, camera, facet, paint);
  }
  for (const Facet& facet : facets) {
    if (faces_viewer(facet, camera)) draw_front(page, camera, facet, paint);
  }
  if (paint.opacity < 1.0) return;
  for (const Facet& facet : facets) {  // over an opaque front, so that the body is seen whole
    if (!faces_viewer(facet, camera)) draw_back(page, camera, facet, paint);
  }
  for (const Facet& facet : facets) {  // and its visible edges once more over the dashes
    if (faces_viewer(facet, camera))
      page.polygon(projected(camera, facet.polygon), "none", 0, paint.edge_colour,
                   paint.edge_width);
  }
}

void draw_bodies(SvgPage& page, const Camera& camera, std::span<const PaintedBody> bodies) {
  struct Entry {
    double nearness;
    const Facet* facet;
    const Paint* paint;
  };
  std::vector<Entry> order;
  for (const PaintedBody& body : bodies) {
    for (const Facet& facet : body.facets) {
      double sum = 0;
      for (const Vector& p : facet.polygon) sum += camera.nearness(p);
      order.push_back({sum / static_cast<double>(facet.polygon.size()), &facet, &body.paint});
    }
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const Entry& l, const Entry& r) { return l.nearness < r.nearness; });
  for (const Entry& entry : order) {
    if (faces_viewer(*entry.facet, camera)) {
      draw_front(page, camera, *entry.facet, *entry.paint);
    } else {
      draw_back(page, camera, *entry.facet, *entry.paint);
    }
  }
}

void draw_arrow(SvgPage& page, const Camera& camera, const Vector& from, const Vector& along,
                const std::string& colour, double width, const std::string& words) {
  const Pixel start = camera.project(from), end = camera.project(from + along);
  page.arrow(start, end, colour, width);
  if (words.empty()) return;
  const double dx = end.x - start.x, dy = end.y - start.y;
  const double length = std::max(1e-6, std::hypot(dx, dy));
  const bool left = dx < -0.3 * length;
  page.label({end.x + 10 * dx / length, end.y + 10 * dy / length + 4}, words, colour, 13,
             left ? "end" : (dx > 0.3 * length ? "start" : "middle"));
}

}  // namespace haptic::sim
