// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pareto/headline_scenes.hpp"

#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include "host_sim/lab/peers/peer_catalog.hpp"
#include "host_sim/lab/pegs/peg_tasks.hpp"
#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {
namespace {

constexpr double kPegClearance_m = 1e-4, kPegRadius_m = 0.010, kPegLength_m = 0.060;
constexpr std::uint32_t kRoundSides = 32, kLidSides = 9;

/// Corners of a regular polygon with a side across +x, in the order of the angle.
std::vector<Vector> ring_of(std::uint32_t sides, double apothem_m) {
  const double radius = apothem_m / std::cos(std::numbers::pi / sides);
  std::vector<Vector> corners;
  for (std::uint32_t k = 0; k < sides; ++k) {
    const double angle = 2 * std::numbers::pi * (k + 0.5) / sides;
    corners.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0);
  }
  return corners;
}

/// Upright prism over a convex outline, counter-clockwise.
Solid prism_over(const std::string& name, const std::vector<Vector>& outline, double low_m,
                 double high_m) {
  const auto n = static_cast<std::uint32_t>(outline.size());
  Solid solid{name, {}, {}};
  for (const double z : {low_m, high_m}) {
    for (const Vector& c : outline) solid.vertices.emplace_back(c[0], c[1], z);
  }
  std::vector<std::uint32_t> bottom, top;
  for (std::uint32_t k = 0; k < n; ++k) {
    bottom.push_back(n - 1 - k);
    top.push_back(n + k);
    const std::uint32_t next = (k + 1) % n;
    solid.loops.push_back({k, next, n + next, n + k});
  }
  solid.loops.push_back(std::move(bottom));
  solid.loops.push_back(std::move(top));
  return solid;
}

/// Adds a ring between two polygons, a piece per side.
void add_ring(std::vector<Solid>& pieces, const std::string& name, double inner_m, double outer_m,
              double low_m, double high_m) {
  const auto inner = ring_of(kLidSides, inner_m), outer = ring_of(kLidSides, outer_m);
  for (std::uint32_t k = 0; k < kLidSides; ++k) {
    const std::uint32_t next = (k + 1) % kLidSides;
    Solid piece = prism_over(name, {inner[k], outer[k], outer[next], inner[next]}, low_m, high_m);
    // Both pieces at a seam start its loop at the same vertex, so that their planes agree.
    piece.loops[2] = {3, 7, 6, 2};
    piece.loops[0] = {0, 1, 5, 4};
    pieces.push_back(std::move(piece));
  }
}

struct HandPoint {
  const char* phase;
  double t_s;
  double x_mm, y_mm, z_mm;
  double turn_x_rad, turn_y_rad, turn_z_rad;  ///< rotation vector
  double tremor = 1;                          ///< share of the tremor
};

HeadlineScene scene_from(std::string name, std::string title, std::span<const Solid> moving,
                         std::span<const Solid> fixed, const Vector& grip,
                         std::span<const HandPoint> way, bool quick) {
  HeadlineScene scene;
  scene.name = std::move(name);
  scene.title = std::move(title);
  tools::SceneDescription& d = scene.description;
  d.name = scene.name;
  d.moving.body = united_body(moving);
  d.statics.emplace_back();
  d.statics.back().body = united_body(fixed);
  for (std::size_t k = 0; k < 3; ++k) d.grip_m[k] = grip[static_cast<Eigen::Index>(k)];
  d.parameters.k_f_n_per_m = kHeadlineStiffness_n_per_m;
  for (Solid solid : moving) {
    for (Vector& v : solid.vertices) v -= grip;
    scene.bodies.moving.push_back(peer_solid(solid));
  }
  for (const Solid& solid : fixed) scene.bodies.fixed.push_back(peer_solid(solid));

  MotionScript script;
  script.rate_hz = 1000.0 * kHeadlineSubsteps;
  script.seed = 7;
  script.tremor.position_m = 2e-4;
  script.tremor.angle_rad = 2e-3;
  for (const HandPoint& at : way) {
    WayPoint point;
    point.phase = at.phase;
    point.t_s = quick ? at.t_s / 6 : at.t_s;
    const double mm[3] = {at.x_mm, at.y_mm, at.z_mm};
    for (std::size_t k = 0; k < 3; ++k) point.p[k] = 1e-3 * mm[k];
    const Vector turn(at.turn_x_rad, at.turn_y_rad, at.turn_z_rad);
    const double angle = turn.norm();
    const Rotation q(Eigen::AngleAxisd(angle, angle > 0 ? Vector(turn / angle) : Vector::UnitZ()));
    point.q_wxyz[0] = q.w(), point.q_wxyz[1] = q.x();
    point.q_wxyz[2] = q.y(), point.q_wxyz[3] = q.z();
    point.tremor = at.tremor;
    script.waypoints.push_back(point);
  }
  scene.goals = make_motion(script);
  return scene;
}

/// Share of the tremor while the hand aims at a hole: within the clearance.
constexpr double kAim = 0.15;

// The way of both pegs, 60 mm long, their middle at the origin; rim at z = 0, hole 40 mm deep.
constexpr HandPoint kPegWay[] = {{"start", 0.0, 1.5, -1.0, 34, 0.03, 0.02, 0},
                                 {"touch the rim", 0.5, 2.0, -1.2, 29, 0.03, 0.02, 0},
                                 {"slide to the hole", 1.2, 0, 0, 29.2, 0, 0, 0, kAim},
                                 {"enter", 2.0, 0, 0, 15, 0, 0, 0, kAim},
                                 {"press a wall", 2.6, 0.9, 0.1, 10, 0, 0, 0},
                                 {"slide along it", 3.3, 0.8, 0.2, -2, 0.004, 0.004, 0.01},
                                 {"press the floor", 3.8, 0.2, -0.3, -11.2, 0, 0, 0},
                                 {"wobble", 4.3, -0.2, 0.2, -10.6, 0.02, -0.01, 0.02},
                                 {"wobble back", 4.8, 0.2, -0.1, -8, -0.02, 0.015, -0.02},
                                 {"press a corner", 5.4, -0.8, 0.7, -4, 0, 0.005, 0},
                                 {"come out", 6.2, 0.3, 0.2, 34, 0.02, 0, 0}};

HeadlineScene square_peg_scene(bool quick) {
  const Solid peg = square_peg();
  const auto hole = five_piece_hole(kPegRadius_m + kPegClearance_m);
  return scene_from("square_peg", "square peg, 0.1 mm of clearance", {&peg, 1}, hole,
                    Vector::Zero(), kPegWay, quick);
}

HeadlineScene round_peg_scene(bool quick) {
  const Solid peg = prism_over("peg", ring_of(kRoundSides, kPegRadius_m), -0.5 * kPegLength_m,
                               0.5 * kPegLength_m);
  const auto hole = prism_hole(kRoundSides, kPegRadius_m + kPegClearance_m, 1, 1);
  return scene_from("round_peg", "round peg of 32 sides, 0.1 mm of clearance", {&peg, 1}, hole,
                    Vector::Zero(), kPegWay, quick);
}

/// As host_sim/scenes/pin_field: square pins of 6 mm, hexagonal posts of 3.5 mm radius, 16 mm
/// apart.
HeadlineScene pin_field_scene(bool quick) {
  constexpr int kSide = 5;
  constexpr double kPitch_m = 0.016, kPinHalf_m = 0.003, kPinLength_m = 0.024;
  constexpr double kPostRadius_m = 0.0035, kPostLength_m = 0.020, kPostTurn_rad = 0.1;
  std::vector<Solid> pins, posts;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      const Vector pin((i - 2) * kPitch_m, (j - 2) * kPitch_m, 0);
      pins.push_back(box_solid("pin", pin - Vector(kPinHalf_m, kPinHalf_m, 0),
                               pin + Vector(kPinHalf_m, kPinHalf_m, kPinLength_m)));
      const Vector post = pin + Vector(0.5 * kPitch_m, 0.5 * kPitch_m, 0);
      std::vector<Vector> outline;
      for (int k = 0; k < 6; ++k) {
        const double angle = kPostTurn_rad + k * std::numbers::pi / 3;
        outline.emplace_back(post + kPostRadius_m * Vector(std::cos(angle), std::sin(angle), 0));
      }
      posts.push_back(prism_over("post", outline, -kPostLength_m, 0));
    }
  }
  constexpr HandPoint kWay[] = {{"start", 0.0, 6.0, 7.0, 4, 0.04, -0.04, 0},
                                {"touch the tops", 0.5, 6.0, 7.0, -0.6, 0, 0, 0},
                                {"slide off the tops", 1.1, 0.4, 0.2, -0.6, 0, 0, 0},
                                {"enter", 1.7, 0, 0, -12, 0, 0, 0},
                                {"press diagonally", 2.2, 3.0, 2.8, -13, 0, 0, 0},
                                {"slide along the posts", 2.9, 3.2, 2.4, -16, 0, 0, 0},
                                {"press the other way", 3.6, -2.8, 3.1, -15, 0, 0, 0},
                                {"turn", 4.2, 0, 0, -15, 0, 0, 0.1},
                                {"wobble", 4.8, 0.5, 0, -12, 0.04, 0.02, 0},
                                {"wobble back", 5.4, 0, 0.5, -10, -0.03, 0.03, 0},
                                {"come out", 6.2, 0, 0, 5, 0, 0, 0}};
  return scene_from("pin_field", "25 pins among 25 posts", pins, posts, Vector(0, 0, 0.04), kWay,
                    quick);
}

/// A bin with a rim outside, and a lid whose groove goes over it: 19 pieces each.
HeadlineScene lid_scene(bool quick) {
  constexpr double kInner_m = 0.025, kOuter_m = 0.0275, kRim_m = 0.031, kClear_m = 3e-4;
  constexpr double kHeight_m = 0.030, kRimHeight_m = 0.003, kFloor_m = 0.003, kWall_m = 0.0025;
  constexpr double kSkirt_m = 0.006, kPlug_m = 0.005, kPlate_m = 0.003;
  const double far = kRim_m + kClear_m + kWall_m, near = kInner_m - kClear_m;
  std::vector<Solid> bin, lid;
  bin.push_back(
      prism_over("floor", ring_of(kLidSides, kOuter_m), -kHeight_m, kFloor_m - kHeight_m));
  add_ring(bin, "wall", kInner_m, kOuter_m, kFloor_m - kHeight_m, 0);
  add_ring(bin, "rim", kOuter_m, kRim_m, -kRimHeight_m, 0);
  lid.push_back(prism_over("plate", ring_of(kLidSides, far), 0, kPlate_m));
  add_ring(lid, "skirt", kRim_m + kClear_m, far, -kSkirt_m, 0);
  add_ring(lid, "plug", near - kWall_m, near, -kPlug_m, 0);
  constexpr HandPoint kWay[] = {{"start", 0.0, 3, 2, 14, 0.05, 0.03, 0},
                                {"touch askew", 0.5, 3, 2, 4.5, 0.05, 0.03, 0},
                                {"slide over the rim", 1.2, 0, 0, 4.8, 0, 0, 0, kAim},
                                {"enter", 1.8, 0, 0, 1.5, 0, 0, 0, kAim},
                                {"press into the seat", 2.3, 0, 0, -1, 0, 0, 0},
                                {"slide", 2.8, 1.2, 0.5, -0.8, 0, 0, 0},
                                {"turn", 3.4, 0.2, 0.3, -0.6, 0, 0, 0.05},
                                {"wobble", 4.0, 0.4, 0, -0.6, 0.03, -0.02, 0},
                                {"wobble back", 4.6, -0.4, 0.2, -0.4, -0.02, 0.03, 0},
                                {"press deep", 5.2, -0.8, -0.6, -2.5, 0, 0, 0},
                                {"tilt out", 5.7, 0, 0, 3, 0.06, 0.02, 0},
                                {"come out", 6.2, 1, 0, 14, 0.05, 0, 0}};
  return scene_from("lid_on_bin", "lid on a bin, both of 19 pieces", lid, bin, Vector::Zero(), kWay,
                    quick);
}

}  // namespace

std::vector<HeadlineScene> headline_scenes(bool quick) {
  std::vector<HeadlineScene> scenes;
  scenes.push_back(square_peg_scene(quick));
  scenes.push_back(round_peg_scene(quick));
  scenes.push_back(pin_field_scene(quick));
  scenes.push_back(lid_scene(quick));
  return scenes;
}

}  // namespace haptic::sim
