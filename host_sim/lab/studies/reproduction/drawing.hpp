// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Pictures of polyhedra as SVG: an orthographic camera and the drawing of convex
/// bodies with their hidden faces. Lengths in m in space, pixels on the page (y downwards).

#include <string>
#include <vector>

#include "host_sim/report/picture.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "tools/c_space/c_obstacle.hpp"

namespace haptic::sim {

using tools::CFace;
using tools::CObstacle;
using tools::FlatPair;
using tools::make_c_obstacle;
using tools::node_text;
using tools::place_moving;
using tools::planar_hull;
using tools::Point;
using tools::vector_of;

/// Orthographic view: parallel to `-toward_viewer`, `up` upwards on the page.
class Camera {
 public:
  Camera(const Vector& toward_viewer, const Vector& up, const Vector& centre, Pixel page_centre,
         double pixels_per_m);

  [[nodiscard]] Pixel project(const Vector& p) const;
  /// Larger is nearer to the viewer [m].
  [[nodiscard]] double nearness(const Vector& p) const { return toward_.dot(p); }
  [[nodiscard]] const Vector& toward_viewer() const { return toward_; }

 private:
  Vector toward_, right_, up_, centre_;
  Pixel page_;
  double scale_;
};

/// One polygon of a body in W.
struct Facet {
  std::vector<Vector> polygon;
  Vector normal = Vector::Zero();
  bool lit = false;  ///< drawn in the highlight colour
};

[[nodiscard]] std::vector<Facet> facets_of(const Solid& solid, const Vector& p, const Rotation& q);
/// The faces of a C-obstacle; those that hold one of `near` are lit.
[[nodiscard]] std::vector<Facet> facets_of(const CObstacle& obstacle,
                                           std::span<const std::uint32_t> near);

/// How a body is painted: its colour at full light, and how much shows through its front.
struct Paint {
  double red = 150, green = 170, blue = 200;  ///< 0 to 255
  double opacity = 1.0;
  bool hidden_edges = true;
  double edge_width = 1.2;
  const char* edge_colour = "#303030";
};

/// A convex body: back faces first (their edges dashed), then the front faces, lighter towards the
/// light, lit faces in the highlight colour.
void draw_body(SvgPage& page, const Camera& camera, std::span<const Facet> facets,
               const Paint& paint);

/// Several translucent bodies in one picture: all their faces, farthest first (painter's order).
struct PaintedBody {
  std::vector<Facet> facets;
  Paint paint;
};
void draw_bodies(SvgPage& page, const Camera& camera, std::span<const PaintedBody> bodies);

/// Arrow from `from` along `along`, with a label at its head when `words` is not empty.
void draw_arrow(SvgPage& page, const Camera& camera, const Vector& from, const Vector& along,
                const std::string& colour, double width, const std::string& words);

}  // namespace haptic::sim
