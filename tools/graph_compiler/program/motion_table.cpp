// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/motion_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

namespace haptic::tools {
namespace {

constexpr Range kSpeed{0.0, std::numeric_limits<double>::infinity(), true};
/// A half turn reaches every orientation; more is taken for degrees.
constexpr Range kAngle{0.0, 3.1416};
constexpr Range kComponent{-2.0, 2.0};
constexpr Range kPlace{-1e5, 1e5};

std::array<double, 4> to_xyzw(const std::array<double, 4>& wxyz) {
  return {wxyz[1], wxyz[2], wxyz[3], wxyz[0]};
}

/// `about`: "start" or [w, x, y, z] of unit length.
std::array<double, 4> read_about(const TomlTable& t, const ScenePart& moving) {
  if (!t.has("about")) return to_xyzw(moving.quaternion_wxyz);
  if (t.is_text("about")) {
    if (*t.text("about") != "start") {
      t.fail("about", "is '" + *t.text("about") + "'; give \"start\" or four numbers [w, x, y, z]");
    }
    return to_xyzw(moving.quaternion_wxyz);
  }
  std::array<double, 4> q = *t.vector4("about", kComponent);
  double square = 0.0;
  for (const double x : q) square += x * x;
  const double length = std::sqrt(square);
  if (!(std::abs(length - 1.0) <= 1e-6)) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", length);
    t.fail("about", std::string("has length ") + text + "; divide its components by that");
  }
  for (double& x : q) x /= length;
  return to_xyzw(q);
}

OrientationEnvelope read_orientation(const TomlTable& t, const ScenePart& moving) {
  OrientationEnvelope envelope;
  envelope.about_xyzw = read_about(t, moving);
  const auto angle = t.number("max_angle_rad", kAngle);
  if (!angle) t.fail_missing("max_angle_rad", "give the largest tilt from `about` in radians");
  envelope.max_angle_rad = std::min(*angle, std::numbers::pi);
  return envelope;
}

WorkspaceBox read_workspace(const TomlTable& t) {
  const auto low = t.vector3("min_m", kPlace), high = t.vector3("max_m", kPlace);
  if (!low) t.fail_missing("min_m", "give the lowest x, y and z of the grip point in W");
  if (!high) t.fail_missing("max_m", "give the highest x, y and z of the grip point in W");
  for (std::size_t k = 0; k < 3; ++k) {
    if (!((*low)[k] <= (*high)[k])) {
      t.fail("max_m", std::string("is below min_m in ") + "xyz"[k] + "; exchange the two");
    }
  }
  return {*low, *high};
}

void read_speeds(const TomlTable& limits, SceneParameters& p) {
  const auto linear = limits.number("linear_m_per_s", kSpeed);
  const auto angular = limits.number("angular_rad_per_s", kSpeed);
  const bool ranges_alone = limits.has("orientation") || limits.has("workspace");
  if (!linear && !angular && ranges_alone) return;
  if (!linear) limits.fail_missing("linear_m_per_s", "give the largest speed of the hand");
  if (!angular) limits.fail_missing("angular_rad_per_s", "give the largest turning speed");
  p.motion_limits_given = 1;
  p.max_linear_speed_m_per_s = *linear;
  p.max_angular_speed_rad_per_s = *angular;
}

}  // namespace

void read_motion_table(const TomlTable& top, SceneFile& scene) {
  const auto limits = top.table(
      "motion_limits", {"linear_m_per_s", "angular_rad_per_s", "orientation", "workspace"});
  if (!limits) return;
  read_speeds(*limits, scene.parameters);
  if (const auto orientation = limits->table("orientation", {"about", "max_angle_rad"})) {
    scene.orientation = read_orientation(*orientation, scene.moving);
  }
  if (const auto workspace = limits->table("workspace", {"min_m", "max_m"})) {
    scene.workspace = read_workspace(*workspace);
  }
}

}  // namespace haptic::tools
