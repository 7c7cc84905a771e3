// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/friction/fit_scenes.hpp"

#include <cmath>
#include <numbers>

#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using tools::append_line;

constexpr std::uint32_t kRoundSegments = 24;

void add_prism(FitScene& scene, bool moving, const std::string& name,
               const std::vector<std::array<double, 2>>& polygon, double half_m,
               const Vector& at_m = Vector::Zero()) {
  scene.files.push_back({name + ".obj", obj_text(prism_along_y(polygon, -half_m, half_m))});
  scene.text += mesh_text(moving, name + ".obj", at_m);
}

void add_walls_x(FitScene& scene, double clearance_m) {
  for (const double side : {1.0, -1.0}) {
    scene.text += box_text(false, {0.02, 0.04, 0.2}, {side * (0.015 + clearance_m / 2), 0, 0});
  }
}

FitScene dovetail(double clearance_m) {
  FitScene scene;
  // Flanks that lean in by 3 mm over 6 mm; their clearance is across them.
  const double flank = std::hypot(3.0, 6.0), aside = clearance_m / 2 * flank / 6;
  const double top = 0.006, wide = 0.008, narrow = 0.005, block = 0.02, floor = -0.01;
  add_prism(scene, true, "tongue", {{-wide, 0}, {wide, 0}, {narrow, top}, {-narrow, top}}, 0.02);
  add_prism(scene, false, "right",
            {{wide + aside, 0}, {block, 0}, {block, top}, {narrow + aside, top}}, 0.1);
  add_prism(scene, false, "left",
            {{-block, 0}, {-wide - aside, 0}, {-narrow - aside, top}, {-block, top}}, 0.1);
  const double below = -clearance_m / 2;
  add_prism(scene, false, "floor",
            {{-block, floor + below}, {block, floor + below}, {block, below}, {-block, below}},
            0.1);
  scene.press_w = Vector::UnitZ();
  scene.reach_w = clearance_m / 2 * flank / 3 * Vector::UnitZ();
  scene.slide_w = Vector::UnitY();
  scene.normal_share = flank / 3;
  return scene;
}

FitScene vee(double half_deg) {
  constexpr double kSide_m = 0.02, kWall_m = 0.05, kLift_m = 1e-5;
  FitScene scene;
  const double s = std::sin(half_deg * std::numbers::pi / 180);
  const double c = std::cos(half_deg * std::numbers::pi / 180);
  add_prism(scene, true, "wedge", {{0, 0}, {kSide_m * s, kSide_m * c}, {-kSide_m * s, kSide_m * c}},
            0.015, {0, 0, kLift_m});
  const double w = kWall_m;
  add_prism(scene, false, "right",
            {{0, 0}, {w * c, -w * s}, {w * s + w * c, w * c - w * s}, {w * s, w * c}}, 0.1);
  add_prism(scene, false, "left",
            {{0, 0}, {-w * s, w * c}, {-w * s - w * c, w * c - w * s}, {-w * c, -w * s}}, 0.1);
  scene.press_w = -Vector::UnitZ();
  scene.slide_w = Vector::UnitY();
  scene.normal_share = 1 / s;
  scene.locks_at = s / c;
  return scene;
}

FitScene tube(double clearance_m) {
  constexpr double kRadius_m = 0.005, kHeight_m = 0.04;
  // Of half a facet. The middle of one is nearer to the axis than the corners of the peg, and as
  // near as the radius of the bore.
  const double a = std::numbers::pi / kRoundSegments;
  FitScene scene;
  append_line(scene.text,
              "[moving]\nshape = \"cylinder\"\nradius_m = %.17g\nheight_m = %g\nsegments = %u\n"
              "position_m = [0, 0, 0]\nmaterial = \"a\"",
              kRadius_m, kHeight_m, kRoundSegments);
  append_line(scene.text,
              "[[static]]\nshape = \"tube\"\ninner_radius_m = %.17g\nouter_radius_m = 0.012\n"
              "height_m = 0.2\nsegments = %u\nmaterial = \"b\"",
              kRadius_m * std::cos(a) + clearance_m / 2, kRoundSegments);
  // It is pressed on the middle of a facet.
  scene.press_w = Vector(std::cos(a), std::sin(a), 0);
  scene.reach_w = clearance_m / 2 * scene.press_w;
  return scene;
}

}  // namespace

const char* fit_name(FitKind kind) {
  switch (kind) {
    case FitKind::kSlot:
      return "slot";
    case FitKind::kHole:
      return "square hole";
    case FitKind::kTube:
      return "tube";
    case FitKind::kDovetail:
      return "dovetail";
    case FitKind::kVee15:
      return "V groove 15";
    case FitKind::kVee45:
      return "V groove 45";
    case FitKind::kCorner:
      return "corner";
  }
  return "";
}

FuzzMesh prism_along_y(const std::vector<std::array<double, 2>>& polygon, double low_m,
                       double high_m) {
  FuzzMesh mesh;
  mesh.closed = true;
  const auto n = static_cast<std::uint32_t>(polygon.size());
  for (const double y : {low_m, high_m}) {
    for (const auto& [x, z] : polygon) mesh.vertices.emplace_back(x, y, z);
  }
  for (std::uint32_t k = 1; k + 1 < n; ++k) {
    mesh.triangles.push_back({0, k, k + 1});
    mesh.triangles.push_back({n, n + k + 1, n + k});
  }
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::uint32_t next = (k + 1) % n;
    mesh.triangles.push_back({next, k, n + k});
    mesh.triangles.push_back({next, n + k, n + next});
  }
  return mesh;
}

std::string box_text(bool moving, const Vector& size_m, const Vector& at_m) {
  return tools::formatted(
      "[%s]\nshape = \"box\"\nsize_m = [%.17g, %.17g, %.17g]\nposition_m = [%.17g, %.17g, "
      "%.17g]\nmaterial = \"%s\"\n",
      moving ? "moving" : "[static]", size_m[0], size_m[1], size_m[2], at_m[0], at_m[1], at_m[2],
      moving ? "a" : "b");
}

std::string mesh_text(bool moving, const std::string& file, const Vector& at_m) {
  return tools::formatted(
      "[%s]\nmesh = \"%s\"\nscale_to_m = 1\nposition_m = [%.17g, %.17g, %.17g]\nmaterial = "
      "\"%s\"\n",
      moving ? "moving" : "[static]", file.c_str(), at_m[0], at_m[1], at_m[2], moving ? "a" : "b");
}

FitScene fit_scene(FitKind kind, double clearance_m) {
  FitScene scene;
  switch (kind) {
    case FitKind::kDovetail:
      return dovetail(clearance_m);
    case FitKind::kVee15:
      return vee(15);
    case FitKind::kVee45:
      return vee(45);
    case FitKind::kTube:
      return tube(clearance_m);
    case FitKind::kCorner:
      scene.text = box_text(true, {0.01, 0.02, 0.01}, Vector::Zero()) +
                   box_text(false, {0.02, 0.3, 0.04}, {0.015 + clearance_m, 0, 0}) +
                   box_text(false, {0.06, 0.3, 0.02}, {0, 0, -0.015 - clearance_m});
      scene.press_w = Vector(1, 0, -1);
      scene.reach_w = clearance_m * scene.press_w;
      scene.slide_w = Vector::UnitY();
      scene.normal_share = 2;
      scene.locks_at = 1;
      return scene;
    case FitKind::kSlot:
    case FitKind::kHole:
      break;
  }
  scene.text = box_text(true, {0.01, 0.01, 0.05}, Vector::Zero());
  add_walls_x(scene, clearance_m);
  if (kind == FitKind::kHole) {
    for (const double side : {1.0, -1.0}) {
      scene.text += box_text(false, {0.04, 0.02, 0.2}, {0, side * (0.015 + clearance_m / 2), 0});
    }
  }
  scene.press_w = Vector::UnitX();
  scene.reach_w = clearance_m / 2 * Vector::UnitX();
  return scene;
}

std::string scene_text(const std::string& parts, double k_n_per_m, double friction,
                       std::uint32_t passes, std::uint32_t units) {
  std::string text = "format = 1\nname = \"fit\"\n" + parts;
  append_line(text, "[rendering]\nk_f_n_per_m = %g", k_n_per_m);
  if (passes > 0) append_line(text, "[coupling]\npasses = %u", passes);
  if (units > 0) append_line(text, "[budget]\nwork_units = %u", units);
  if (friction > 0)
    append_line(text, "[[friction]]\nmaterials = [\"a\", \"b\"]\nmu = %g", friction);
  return text;
}

}  // namespace haptic::sim
