// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Pictures of polyhedra as SVG: an orthographic camera, a page of marks, and the drawing of convex
/// bodies with their hidden faces. Lengths in m in space, pixels on the page (y downwards).

#include <string>
#include <vector>

#include "host_sim/shapes/c_obstacle.hpp"

namespace haptic::sim {

struct Pixel {
  double x = 0, y = 0;
};

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

/// Collects marks; `finish` gives the whole file.
class SvgPage {
 public:
  SvgPage(double width, double height, const std::string& title);

  void polygon(std::span<const Pixel> points, const std::string& fill, double opacity,
               const std::string& stroke, double stroke_width, const char* part = nullptr);
  void line(Pixel from, Pixel to, const std::string& colour, double width, bool dashed = false);
  void arrow(Pixel from, Pixel to, const std::string& colour, double width);
  void dot(Pixel at, double radius, const std::string& fill);
  void text(double x, double y, const std::string& words, const char* anchor, int size,
            const char* extra = "");
  /// Words over a light halo, readable on any ground.
  void label(Pixel at, const std::string& words, const std::string& colour, int size = 13,
             const char* anchor = "start");
  void raw(const std::string& svg) { body_ += svg; }
  void begin_group(const std::string& name);
  void end_group() { body_ += "</g>\n"; }
  [[nodiscard]] std::string finish() const { return body_ + "</svg>\n"; }

 private:
  std::string body_;
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

/// Colours of the pictures; they stay apart for colour-blind readers (Okabe and Ito).
inline constexpr const char* kForceColour = "#d55e00";
inline constexpr const char* kTorqueColour = "#0072b2";
inline constexpr const char* kPointColour = "#000000";
inline constexpr const char* kRegionColour = "#009e73";
inline constexpr const char* kLitColour = "#e69f00";

}  // namespace haptic::sim
