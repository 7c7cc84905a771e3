// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pegs/peg_tasks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "host_sim/shapes/contact_case.hpp"

namespace haptic::sim {
namespace {

constexpr double kHoleDepth_m = 0.040, kHoleFloor_m = 0.010, kHalfLength_m = 0.030;
constexpr double kHalfWidth_m = 0.010;
/// Share of the depth over which the hand straightens the part, from the rim on.
constexpr double kStraightenShare = 0.5;
/// How far the hand pushes beyond the end, and for how long.
constexpr double kPushShare = 0.05, kPause_s = 0.2;
constexpr double kOut_m_per_s = 0.05;

constexpr PegWay kWays[] = {{"straight", 0, 0, 0.02},
                            {"aside", 0.12, 0, 0.02},
                            {"tilted", 0, 0.08, 0.02},
                            {"over_the_rim", 0.2, 0.1, 0.02},
                            {"fast", 0.12, 0.08, 0.1}};

double soft_step(double u) {
  const double s = std::clamp(u, 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

/// Way from outside to inside, and back [m].
double way_in_m(const PegTask& task) { return 1.25 * task.seat.depth_m; }

/// Corners of a regular polygon with a side across +x, squeezed along y.
std::vector<std::array<double, 2>> polygon(std::uint32_t sides, double half_width_m,
                                           double squeeze) {
  const double radius = half_width_m / std::cos(std::numbers::pi / sides);
  std::vector<std::array<double, 2>> corners;
  for (std::uint32_t k = 0; k < sides; ++k) {
    const double angle = 2 * std::numbers::pi * (k + 0.5) / sides;
    corners.push_back({radius * std::cos(angle), squeeze * radius * std::sin(angle)});
  }
  return corners;
}

Solid upright_prism(const std::string& name, const std::vector<std::array<double, 2>>& corners,
                    double low, double high) {
  const auto n = static_cast<std::uint32_t>(corners.size());
  Solid solid{name, {}, {}};
  std::vector<std::uint32_t> bottom, top;
  for (const double z : {low, high}) {
    for (const auto& c : corners) solid.vertices.emplace_back(c[0], c[1], z);
  }
  for (std::uint32_t k = 0; k < n; ++k) {
    bottom.push_back(n - 1 - k);
    top.push_back(n + k);
    const std::uint32_t next = (k + 1) % n;
    solid.loops.push_back({k, next, n + next, n + k});
  }
  solid.loops.push_back(bottom);
  solid.loops.push_back(top);
  return solid;
}

double radius_of(const Solid& solid) {
  double radius = 0;
  for (const Vector& v : solid.vertices) radius = std::max(radius, v.norm());
  return radius;
}

PegTask own_task(std::uint32_t sides, double squeeze, double clearance_m, double scale,
                 const PegWay& way) {
  const double half = kHalfWidth_m * scale;
  // The walls stand off by the clearance along y too.
  const double hole_squeeze = (squeeze * half + clearance_m) / (half + clearance_m);
  const Solid peg = upright_prism("peg", polygon(sides, half, squeeze), -kHalfLength_m * scale,
                                  kHalfLength_m * scale);
  PegTask task;
  task.name = (squeeze < 1 ? "flat" : std::to_string(sides)) + "_" +
              std::to_string(std::lround(1e6 * clearance_m)) + "um_" +
              std::to_string(std::lround(1e3 * half)) + "mm_" + way.name;
  task.scene.name = task.name;
  task.scene.moving.body = united_body({&peg, 1});
  tools::PlacedBody hole;
  hole.body = united_body(prism_hole(sides, half + clearance_m, hole_squeeze, scale));
  task.scene.statics.push_back(hole);
  task.radius_m = radius_of(peg);
  task.seat.in.p = Vector(0, 0, (kHalfLength_m - kHoleDepth_m) * scale);
  task.seat.depth_m = kHoleDepth_m * scale;
  task.seat.half_width_m = half;
  task.way = way;
  return task;
}

}  // namespace

std::vector<Solid> prism_hole(std::uint32_t sides, double half_width_m, double squeeze,
                              double scale) {
  const double low = -kHoleDepth_m * scale;
  const auto inner = polygon(sides, half_width_m, squeeze);
  const auto outer = polygon(sides, half_width_m + 0.02 * scale, 1);
  std::vector<Solid> pieces;
  for (std::uint32_t k = 0; k < sides; ++k) {
    const std::uint32_t next = (k + 1) % sides;
    Solid wall = upright_prism("wall " + std::to_string(k),
                               {inner[k], outer[k], outer[next], inner[next]}, low, 0);
    // Both walls at a seam start its loop at the same vertex, so that their planes agree.
    wall.loops[2] = {3, 7, 6, 2};
    wall.loops[0] = {0, 1, 5, 4};
    pieces.push_back(std::move(wall));
  }
  pieces.push_back(upright_prism("floor", outer, low - kHoleFloor_m * scale, low));
  return pieces;
}

double duration_s(const PegTask& task) {
  return way_in_m(task) / task.way.speed_m_per_s + 2 * kPause_s + way_in_m(task) / kOut_m_per_s;
}

PathPose hand_of(const PegTask& task, double t_s) {
  const PegSeat& seat = task.seat;
  const double in_s = way_in_m(task) / task.way.speed_m_per_s;
  const double out_at = in_s + 2 * kPause_s;
  // How far the part still has to go, the push beyond the end included.
  double left = way_in_m(task) * (1 - std::min(t_s / in_s, 1.0));
  left -= kPushShare * seat.depth_m * soft_step((t_s - in_s) / kPause_s);
  if (t_s > out_at) left += kOut_m_per_s * (t_s - out_at);
  const double into = seat.depth_m - left;
  const double askew = t_s > in_s ? 0 : 1 - soft_step(into / (kStraightenShare * seat.depth_m));
  const Vector across = seat.direction.unitOrthogonal();
  const Vector other = seat.direction.cross(across);
  PathPose pose;
  const Vector aside = (0.8 * across + 0.6 * other) * (task.way.aside_share * seat.half_width_m);
  pose.p = seat.in.p - left * seat.direction + askew * aside;
  pose.q =
      turn_about(askew * task.way.tilt_rad, (0.3 * across + 0.95 * other).normalized()) * seat.in.q;
  return pose;
}

std::vector<PegTask> peg_tasks(bool quick) {
  std::vector<PegTask> tasks;
  struct Shape {
    std::uint32_t sides;
    double squeeze;
  };
  const std::vector<Shape> shapes = quick ? std::vector<Shape>{{4, 1}, {12, 1}}
                                          : std::vector<Shape>{{4, 1}, {4, 0.6}, {12, 1}, {16, 1}};
  const std::vector<double> clearances =
      quick ? std::vector<double>{1e-4} : std::vector<double>{1e-3, 1e-4, 1e-5};
  for (const Shape& shape : shapes) {
    for (const double clearance_m : clearances) {
      for (const PegWay& way : kWays)
        tasks.push_back(own_task(shape.sides, shape.squeeze, clearance_m, 1, way));
    }
  }
  if (!quick) {
    for (const double scale : {0.1, 10.0}) {
      for (const PegWay& way : kWays) {
        tasks.push_back(own_task(4, 1, 1e-4 * scale, scale, way));
        tasks.push_back(own_task(12, 1, 1e-4 * scale, scale, way));
      }
    }
    tasks.push_back(own_task(64, 1, 1e-4, 1, kWays[3]));
  }
  return tasks;
}

}  // namespace haptic::sim
