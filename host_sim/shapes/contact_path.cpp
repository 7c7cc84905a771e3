// SPDX-License-Identifier: Apache-2.0
#include "host_sim/shapes/contact_path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace haptic::sim {
namespace {

constexpr double kHalf_m = 0.05;
/// Off the axes of symmetry, so that no torque vanishes by chance.
constexpr double kAside_x_m = 0.004, kAside_y_m = -0.003;
constexpr double kYaw_rad = 0.3;

/// Flatter than this a plane does not bound the height.
constexpr double kLeastSlope = 1e-9;

Rotation turn(double angle_rad, const Vector& axis) {
  return Rotation(Eigen::AngleAxisd(angle_rad, axis.normalized()));
}

std::vector<Vector> edge_directions(const Solid& solid, const Rotation& q) {
  std::vector<Vector> directions;
  for (const auto& loop : solid.loops) {
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const std::uint32_t from = loop[k], to = loop[(k + 1) % loop.size()];
      if (from < to)
        directions.push_back(q * (solid.vertices[to] - solid.vertices[from]).normalized());
    }
  }
  return directions;
}

std::vector<Vector> face_normals(const Solid& solid, const Rotation& q) {
  std::vector<Vector> normals;
  for (const auto& loop : solid.loops) {
    const Vector& origin = solid.vertices[loop[0]];
    Vector sum = Vector::Zero();
    for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
      sum += (solid.vertices[loop[k]] - origin).cross(solid.vertices[loop[k + 1]] - origin);
    }
    normals.push_back(q * sum.normalized());
  }
  return normals;
}

/// Linear from `from` to `to` with the parameter.
double along(double s, double from, double to) { return from + s * (to - from); }

}  // namespace

double height_at_depth(const Solid& a, const Solid& b, const Rotation& q, double x, double y,
                       double depth_m) {
  std::vector<Vector> normals = face_normals(b, Rotation::Identity());
  for (const Vector& n : face_normals(a, q)) normals.push_back(-n);
  for (const Vector& u : edge_directions(a, q)) {
    for (const Vector& v : edge_directions(b, Rotation::Identity())) {
      const Vector m = u.cross(v);
      if (m.norm() < 1e-9) continue;
      normals.push_back(m.normalized());
      normals.push_back(-m.normalized());
    }
  }
  double height = std::numeric_limits<double>::max();
  for (const Vector& n : normals) {
    if (n.z() < kLeastSlope) continue;
    double highest = std::numeric_limits<double>::lowest(), lowest = -highest;
    for (const Vector& v : b.vertices) highest = std::max(highest, n.dot(v));
    for (const Vector& v : a.vertices) lowest = std::min(lowest, n.dot(q * v));
    // n.x <= h(n) - depth, h(n) = highest - lowest.
    height = std::min(height, (highest - lowest - depth_m - n.x() * x - n.y() * y) / n.z());
  }
  return height;
}

std::vector<ContactPath> contact_paths() {
  const Solid a = centred_box("A", kHalf_m, kHalf_m, kHalf_m);
  const Solid b = centred_box("B", kHalf_m, kHalf_m, kHalf_m);
  const auto over = [a, b](const Rotation& q, double x, double y) -> PathPose {
    return {{x, y, height_at_depth(a, b, q, x, y, kPathDepth_m)}, q};
  };
  const Rotation yaw = turn(kYaw_rad, Vector::UnitZ());
  std::vector<ContactPath> paths;
  paths.push_back({"edge_rolling", "an edge rolls through parallel to a face", a, b, [=](double s) {
                     const Rotation edge_down = turn(std::numbers::pi / 4, Vector::UnitX());
                     const Rotation pitch = turn(along(s, -0.1, 0.1), Vector::UnitY());
                     return over(yaw * pitch * edge_down, kAside_x_m, kAside_y_m);
                   }});
  paths.push_back({"face_rolling", "a face rolls through parallel to a face", a, b, [=](double s) {
                     const Vector axis(std::cos(0.5), std::sin(0.5), 0);
                     return over(yaw * turn(along(s, -0.05, 0.05), axis), kAside_x_m, kAside_y_m);
                   }});
  paths.push_back({"leaving_region", "flat face on face, pi leaves the contact region", a, b,
                   [=](double s) { return over(yaw, along(s, -0.03, 0.09), kAside_y_m); }});
  paths.push_back({"flat_yaw", "flat face on face, yaw through aligned edges", a, b, [=](double s) {
                     return over(turn(along(s, -0.4, 0.4), Vector::UnitZ()), kAside_x_m,
                                 kAside_y_m);
                   }});
  paths.push_back({"general_motion", "a general smooth motion", a, b,
                   [=](double s) {
                     const double t = 2 * std::numbers::pi * s;
                     const Rotation q = turn(0.5 * std::sin(t), Vector::UnitZ()) *
                                        turn(0.10 * std::sin(2 * t + 0.4), Vector::UnitY()) *
                                        turn(0.08 * std::sin(t + 1.1), Vector::UnitX());
                     return over(q, 0.030 * std::sin(t + 0.3), 0.025 * std::sin(2 * t + 1.9));
                   },
                   16000});
  paths.push_back({"over_corner", "over an edge of the C-obstacle: two faces equally deep", a, b,
                   [](double s) -> PathPose {
                     return {{2 * kHalf_m - along(s, 0.0024, 0.0010), kAside_x_m,
                              2 * kHalf_m - along(s, 0.0010, 0.0024)},
                             Rotation::Identity()};
                   }});
  return paths;
}

}  // namespace haptic::sim
