// SPDX-License-Identifier: Apache-2.0
#include "host_sim/shapes/contact_case.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace haptic::sim {
namespace {

using std::numbers::pi;
/// Speed of the slow paths.
constexpr double kSlide_m_per_s = 0.02;
constexpr double kFlat_m = kBoxHalf_m[2] - kPush_m;  ///< height of the pushed box on z = 0
constexpr double kCornerHalf_m = 3.0 / 64;
const Vector kCornerBox(1.0 / 32, 3.0 / 128, 1.0 / 32);

CoupledScene on(tools::Body moving, tools::Body fixed, double k_r_nm_per_rad = 1) {
  CoupledScene scene;
  scene.moving = std::move(moving);
  scene.statics.push_back(std::move(fixed));
  scene.k_r_nm_per_rad = k_r_nm_per_rad;
  return scene;
}

tools::Body one(const Solid& solid) { return united_body({&solid, 1}); }

/// A bar of 96 mm, turned by `roll_rad` about its length.
tools::Body bar(double roll_rad) {
  Solid solid = centred_box("bar", 0.048, 0.010, 0.010);
  for (Vector& v : solid.vertices) v = turn_about(roll_rad, Vector::UnitX()) * v;
  return one(solid);
}

/// The bar turns about y at constant speed until it has gone 0.35 rad.
TimedPath swing(double speed_rad_per_s) {
  TimedPath path;
  path.pose = [=](double t) -> PathPose {
    return {Vector::Zero(), turn_about(speed_rad_per_s * t, Vector::UnitY())};
  };
  path.duration_s = 0.35 / speed_rad_per_s;
  path.retreat_w = Vector::Zero();
  path.approach_s = 0.002;
  return path;
}

}  // namespace

TimedPath ContactLoop::path_of(double ticks) const {
  const double cycle_s = ticks * kTracePeriod_s;
  TimedPath path;
  path.pose = [phase = pose, cycle_s](double t) { return phase(t / cycle_s); };
  path.duration_s = 2 * cycle_s;
  path.retreat_w = retreat_w;
  path.approach_s = 1;
  return path;
}

Rotation turn_about(double angle_rad, const Vector& axis) {
  return Rotation(Eigen::AngleAxisd(angle_rad, axis.normalized()));
}

tools::Body sample_box() {
  return one(centred_box("box", kBoxHalf_m[0], kBoxHalf_m[1], kBoxHalf_m[2]));
}

tools::Body sample_block() {
  return one(box_solid("block", {-0.05, -0.05, -0.05}, {0.05, 0.05, 0}));
}

tools::Body sample_plate(bool whole) {
  const tools::Body plate = one(box_solid("plate", {-0.05, -0.05, -0.01}, {0.05, 0.05, 0}));
  if (whole) return plate;
  // Each crosses one piece of those before it: two straight across, one askew, one aslant.
  const CutPlane cuts[4] = {{Vector::UnitX(), -0.03},
                            {Vector::UnitX(), 0.03},
                            {Vector(0.96, 0.28, 0).normalized(), -0.0096},
                            {Vector(0.8, 0, 0.6).normalized(), 0.009}};
  return cut_body(plate, cuts);
}

tools::Body thin_plate(double thickness_m, double half_m) {
  return one(box_solid("thin plate", {-half_m, -half_m, -thickness_m}, {half_m, half_m, 0}));
}

tools::Body corner_body() {
  const double c = kCornerHalf_m, w = 0.125;
  const Solid pieces[3] = {box_solid("floor", {-w, -w, -w}, {w, w, -c}),
                           box_solid("wall x", {c, -w, -c}, {w, w, w}),
                           box_solid("wall y", {-w, c, -c}, {c, w, w})};
  return united_body(pieces);
}

tools::Body corner_box() {
  return one(centred_box("box", kCornerBox[0], kCornerBox[1], kCornerBox[2]));
}

Vector corner_place() {
  const double c = kCornerHalf_m;
  return {c - kCornerBox[0], c - kCornerBox[1], kCornerBox[2] - c};
}

CoupledScene peg_scene(double clearance_m, double friction, double half_length_m) {
  const std::vector<Solid> hole = five_piece_hole(kPegHalf_m + clearance_m);
  CoupledScene scene =
      on(one(centred_box("peg", kPegHalf_m, kPegHalf_m, half_length_m)), united_body(hole), 0.5);
  scene.friction = friction;
  return scene;
}

ContactCase slide_off_case() {
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    return {{kSlide_m_per_s * t, 0, kFlat_m}, Rotation::Identity()};
  };
  path.duration_s = 0.090 / kSlide_m_per_s;
  return {"slide_off", "box face, 3 mm deep, slid off a block", on(sample_box(), sample_block()),
          path, true};
}

ContactCase tilt_case() {
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    return {{0, 0, kFlat_m}, turn_about(0.1 * std::sin(1.6 * t), Vector::UnitY())};
  };
  path.duration_s = 2 * pi / 1.6;
  return {"tilt", "face tilt of 0.1 rad to either side", on(sample_box(), sample_block()), path};
}

ContactCase roll_case() {
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    return {{0.004, -0.003, kFlat_m},
            turn_about(0.5 * std::sin(1.5 * t), Vector::UnitZ()) *
                turn_about(0.12 * std::sin(2.4 * t + 0.4), Vector::UnitY()) *
                turn_about(0.12 * std::sin(1.8 * t + 1.1), Vector::UnitX())};
  };
  path.duration_s = 8;
  path.retreat_w = {0, 0, 0.02};
  path.approach_s = 1;
  return {"roll_tilt_yaw", "roll, tilt and yaw on a block", on(sample_box(), sample_block()), path};
}

ContactCase edge_case() {
  // The edge that is lowest at this tilt runs along y, ahead of the middle.
  const double low = kBoxHalf_m[0] * std::sin(0.3) + kBoxHalf_m[2] * std::cos(0.3);
  TimedPath path;
  path.pose = [low](double t) -> PathPose {
    return {{kSlide_m_per_s * t, 0, low - kPush_m}, turn_about(0.3, Vector::UnitY())};
  };
  path.duration_s = 0.1 / kSlide_m_per_s;
  return {"edge_off", "edge on a face, tilt 0.3 rad, slid off the block",
          on(sample_box(), sample_block(), 0.5), path, true};
}

ContactCase push_case(double depth_m) {
  constexpr double kSpeed_m_per_s = 0.014;
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    return {{0.003, -0.002, kBoxHalf_m[2] + 0.001 - kSpeed_m_per_s * t}, Rotation::Identity()};
  };
  path.duration_s = (depth_m + 0.001) / kSpeed_m_per_s;
  path.approach_s = 0.01;
  path.retreat_w = {0, 0, 0.00014};
  return {"push_plate", "box pushed through a plate of 0.5 mm",
          on(sample_box(), thin_plate(5e-4, 0.05)), path};
}

ContactCase seam_case(double speed_m_per_s, double tilt_rad, bool whole) {
  const double low = kBoxHalf_m[0] * std::sin(tilt_rad) + kBoxHalf_m[2] * std::cos(tilt_rad);
  const double ahead = kBoxHalf_m[0] * std::cos(tilt_rad) - kBoxHalf_m[2] * std::sin(tilt_rad);
  // A small tilt leaves the face flat; a large one puts the box on one edge.
  const double height = tilt_rad < 0.1 ? kFlat_m : low - kPush_m;
  const double begin = tilt_rad < 0.1 ? -0.017 : -0.045 - ahead + 0.01;
  TimedPath path;
  path.pose = [=](double t) -> PathPose {
    return {{begin + speed_m_per_s * t, 0.002, height}, turn_about(tilt_rad, Vector::UnitY())};
  };
  path.duration_s = (tilt_rad < 0.1 ? 0.034 : 0.075) / speed_m_per_s;
  return {"seams", "box over the seams of a five-piece plate",
          on(sample_box(), sample_plate(whole)), path};
}

ContactCase swing_case(double speed_rad_per_s) {
  const Solid block = box_solid("block", {0.030, -0.05, -0.06}, {0.13, 0.05, -0.012});
  return {"swing", "bar swung into an edge", on(bar(0), one(block)), swing(speed_rad_per_s)};
}

ContactCase edge_swing_case() {
  Solid block = centred_box("block", 0.02, 0.05, 0.02);
  for (Vector& v : block.vertices)
    v = turn_about(pi / 4, Vector::UnitY()) * v + Vector(0.030, 0, -0.0162 - 0.02 * std::sqrt(2.0));
  return {"edge_swing", "bar swung edge into edge", on(bar(pi / 4), one(block), 0.5), swing(2)};
}

ContactCase corner_case() {
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    // Begins and ends 4, 3 and 4 mm beyond the walls, and stays beyond them.
    const Vector wander(0.002 * std::sin(pi * t), 0.0015 * std::sin(2 * pi * t),
                        0.002 * std::sin(3 * pi * t));
    return {corner_place() + Vector(0.004, 0.003, -0.004) + wander, Rotation::Identity()};
  };
  path.duration_s = 2;
  path.retreat_w = {-0.02, -0.02, 0.02};
  path.approach_s = 1;
  return {"corner", "corner of three planes", on(corner_box(), corner_body(), 0.5), path};
}

ContactCase insertion_case(double clearance_m) {
  // 10 mm/s from 5 mm above the rim down to 2 mm below the floor, wobbling once the tip is in; then
  // at rest, upright and pushed 2 mm aside.
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    constexpr double kIn_s = 0.7, kDown_s = 4.7, kRest_s = 2;
    const auto soft = [](double from, double to, double at) {
      const double s = std::clamp((at - from) / (to - from), 0.0, 1.0);
      return s * s * (3 - 2 * s);
    };
    const double share = soft(kIn_s, kIn_s + 1, t) * (1 - soft(kDown_s, kDown_s + 1, t));
    const double z = kPegHalfLength_m + 0.005 - 0.010 * std::min(t, kDown_s);
    const double aside = 0.002 * std::clamp((t - kDown_s - 1) / (kRest_s - 1), 0.0, 1.0);
    const double x = share * 0.002 * std::sin(pi * t);
    const double y = share * 0.0015 * std::sin(0.8 * pi * t);
    return {{x + aside, y, z},
            turn_about(share * 0.04 * std::sin(pi * t), Vector::UnitY()) *
                turn_about(share * 0.03 * std::sin(0.7 * pi * t), Vector::UnitX())};
  };
  path.duration_s = 6.8;
  return {"insertion", "peg in five pieces, wobbling into its hole", peg_scene(clearance_m), path};
}

ContactCase tilted_peg_case(double clearance_m) {
  // 25 mm in, the grip point between rim and tip, so that both sides touch.
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    return {{0, 0, kShortPegHalfLength_m - 0.025},
            turn_about(0.1 * std::sin(1.6 * t), Vector::UnitY())};
  };
  path.duration_s = 2 * pi / 1.6;
  path.retreat_w = {0, 0, 0.04};
  return {"tilted_peg", "peg tilted by 0.1 rad in its hole",
          peg_scene(clearance_m, 0, kShortPegHalfLength_m), path};
}

ContactCase mouth_case(double clearance_m) {
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    // 3 mm beyond the middle and back to it.
    const double way = std::min(kSlide_m_per_s * t, 0.042 - kSlide_m_per_s * t);
    return {{-0.018 + way, 0, kPegHalfLength_m - kPush_m}, Rotation::Identity()};
  };
  path.duration_s = 0.024 / kSlide_m_per_s;
  return {"mouth", "peg slid over the mouth of its hole", peg_scene(clearance_m), path, true};
}

std::vector<ContactCase> contact_cases() {
  return {slide_off_case(),     tilt_case(),           roll_case(),
          edge_case(),          push_case(0.025),      seam_case(0.1, 0, false),
          swing_case(2),        edge_swing_case(),     corner_case(),
          insertion_case(1e-4), tilted_peg_case(1e-4), mouth_case(1e-4)};
}

std::vector<ContactLoop> contact_loops() {
  const auto waves = [](double s, double x, double y, double z) {
    const double a = 2 * pi * s;
    return turn_about(z * std::sin(a), Vector::UnitZ()) *
           turn_about(y * std::sin(2 * a + 0.4), Vector::UnitY()) *
           turn_about(x * std::sin(a + 1.1), Vector::UnitX());
  };
  const auto round = [](double s, double x, double y, double z) {
    const double a = 2 * pi * s;
    return Vector(x * std::cos(a), y * std::sin(a), z * std::sin(2 * a));
  };
  std::vector<ContactLoop> loops;
  loops.push_back(
      {"box_on_block", "box on a block", on(sample_box(), sample_block()),
       [=](double s) -> PathPose {
         return {Vector(0, 0, kFlat_m) + round(s, 0.01, 0.008, 0.001), waves(s, 0.04, 0.05, 0.3)};
       }});
  // From 1 mm deep in the top, round outside the edge, to 1 mm deep in the side, and back
  // elsewhere.
  loops.push_back({"round_an_edge",
                   "round an edge of the block",
                   on(sample_box(), sample_block()),
                   [=](double s) -> PathPose {
                     const double a = 2 * pi * s;
                     const double way = 0.25 * pi + 0.82 * pi * std::sin(a);
                     const double radius_m = 0.005 * (1 + 0.1 * std::cos(a));
                     return {{0.05 + kBoxHalf_m[0] + radius_m * std::cos(way), 0.003 * std::sin(a),
                              kBoxHalf_m[2] + radius_m * std::sin(way)},
                             waves(s, 0.02, 0.03, 0.05)};
                   },
                   {0.03, 0, 0.03}});
  loops.push_back({"corner",
                   "corner of three planes",
                   on(corner_box(), corner_body(), 0.5),
                   [=](double s) -> PathPose {
                     return {corner_place() + Vector(0.003, 0.003, -0.003) +
                                 round(s, 0.002, 0.002, 0.002),
                             waves(s, 0.04, 0.05, 0.06)};
                   },
                   {-0.02, -0.02, 0.02}});
  loops.push_back({"peg",
                   "peg with 0.1 mm of clearance",
                   peg_scene(1e-4),
                   [=](double s) -> PathPose {
                     return {Vector(0, 0, kPegHalfLength_m - 0.02) + round(s, 0.002, 0.002, 0.004),
                             waves(s, 0.04, 0.05, 0.06)};
                   },
                   {0, 0, 0.04}});
  loops.push_back(
      {"five_piece_plate", "five-piece plate", on(sample_box(), sample_plate()),
       [=](double s) -> PathPose {
         return {Vector(0, 0, kFlat_m) + round(s, 0.017, 0.01, 0.001), waves(s, 0.03, 0.04, 0.2)};
       }});
  return loops;
}

}  // namespace haptic::sim
