// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/strangers/stranger_pair.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "host_sim/lab/strangers/families.hpp"
#include "host_sim/report/shard_run.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr double kClearances_mm[] = {0.005, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0};
constexpr double kTextShare = 0.2;

constexpr Family kFamilies[] = {{"keyed_shaft", draw_keyed_shaft},
                                {"splined_shaft", draw_splined_shaft},
                                {"stepped_shaft", draw_stepped_shaft},
                                {"hex_socket", draw_hex_socket},
                                {"hex_key", draw_hex_key, 0.005, 0.5},
                                {"ring_on_post", draw_ring_on_post},
                                {"filleted_peg", draw_filleted_peg},
                                {"taper_plug", draw_taper_plug, 0.005, 0.5},
                                {"hinge_pin", draw_hinge_pin},
                                {"gear_pair", draw_gear_pair, 0.02, 0.2},
                                {"bayonet", draw_bayonet, 0.02, 0.5},
                                {"thread_start", draw_thread_start, 0.05, 0.5},
                                {"dowel_plate", draw_dowel_plate},
                                {"pin_plate", draw_pin_plate, 0.005, 0.5},
                                {"connector", draw_connector, 0.005, 0.2},
                                {"card_slot", draw_card_slot, 0.005, 0.5},
                                {"t_slot", draw_t_slot, 0.02, 0.5},
                                {"dovetail", draw_dovetail},
                                {"rail_clip", draw_rail_clip},
                                {"drawer", draw_drawer},
                                {"battery_tray", draw_battery_tray},
                                {"fixture", draw_fixture},
                                {"casting", draw_casting},
                                {"clevis", draw_clevis},
                                {"scan", draw_scan, 0.1, 1},
                                {"brick", draw_brick, 0.005, 0.2}};

const Family& family_named(std::string_view name) {
  for (const Family& family : kFamilies)
    if (family.name == name) return family;
  std::string known;
  for (const Family& family : kFamilies)
    known += (known.empty() ? "" : ", ") + std::string(family.name);
  throw tools::UsageError("no family '" + std::string(name) + "'; known are " + known);
}

/// Two directions across the way.
std::array<Vector, 2> across(const Vector& way) {
  const Vector other = std::abs(way[0]) < 0.9 ? Vector(Vector::UnitX()) : Vector(Vector::UnitY());
  const Vector u = (other - other.dot(way) * way).normalized();
  return {u, way.cross(u)};
}

}  // namespace

Rotation PartPlace::rotation() const {
  using Eigen::AngleAxisd;
  return Rotation(AngleAxisd(rpy_rad[2], Vector::UnitZ()) *
                  AngleAxisd(rpy_rad[1], Vector::UnitY()) *
                  AngleAxisd(rpy_rad[0], Vector::UnitX()));
}

WayPose StrangerPair::start() const {
  WayPose at;
  at.to_go_mm = depth_mm + before_mm;
  at.turn_rad = turn_rad;
  return at;
}

MotionSample StrangerPair::pose(const WayPose& at, double t_s) const {
  const auto [u, v] = across(way);
  const Rotation turn(Eigen::AngleAxisd(at.turn_rad, way));
  const Rotation tilt = Rotation(Eigen::AngleAxisd(at.tilt_rad[1], v)) *
                        Rotation(Eigen::AngleAxisd(at.tilt_rad[0], u));
  const Vector middle = turn * moving.middle_mm();
  const Vector p_mm =
      middle - tilt * middle - at.to_go_mm * way + at.across_mm[0] * u + at.across_mm[1] * v;
  return sample_at(t_s, 1e-3 * p_mm, tilt * turn);
}

std::vector<std::string_view> stranger_families() {
  std::vector<std::string_view> names;
  for (const Family& family : kFamilies) names.push_back(family.name);
  return names;
}

std::vector<double> clearances_of(std::string_view family) {
  const Family& f = family_named(family);
  std::vector<double> clearances;
  for (const double c : kClearances_mm)
    if (c >= f.least_mm && c <= f.most_mm) clearances.push_back(c);
  return clearances;
}

StrangerPair stranger_pair(std::string_view family, std::uint64_t seed,
                           std::optional<double> clearance_mm) {
  const Family& f = family_named(family);
  const auto number = static_cast<std::uint64_t>(&f - kFamilies);
  Seeded random(seed_of(seed, number));
  const std::vector<double> clearances = clearances_of(family);
  // Seeds that follow one another go through all of them.
  const double drawn = clearances[(3 * seed + number) % clearances.size()];
  const bool as_text = random.uniform(0, 1) < kTextShare;
  StrangerPair pair = f.draw(random, clearance_mm.value_or(drawn));
  pair.family = family;
  pair.seed = seed;
  pair.clearance_mm = clearance_mm.value_or(drawn);
  pair.as_text = as_text;
  pair.places.resize(pair.fixed.size());
  return pair;
}

DrawnMesh bored_block(const Outline& bore, const Outline& outside, double depth_mm,
                      double chamfer_mm, double floor_mm) {
  std::vector<Layer> layers;
  if (floor_mm > 0) layers.push_back(straight(-floor_mm, 0, {outside}));
  layers.push_back(straight(0, depth_mm - chamfer_mm, {outside, bore}));
  layers.push_back({depth_mm - chamfer_mm,
                    depth_mm,
                    {outside, bore},
                    {outside, grown_outline(bore, chamfer_mm)}});
  return layered_mesh(layers);
}

DrawnMesh chamfered_peg(const Outline& outline, double length_mm, double chamfer_mm) {
  return layered_mesh({{0, chamfer_mm, {grown_outline(outline, -chamfer_mm)}, {outline}},
                       straight(chamfer_mm, length_mm, {outline})});
}

StrangerPair laid_down(StrangerPair pair) {
  // x to y, y to z, z to x.
  const auto turned = [](const Vector& p) { return Vector(p[2], p[0], p[1]); };
  const auto turn_mesh = [&](DrawnMesh& mesh) {
    for (auto& triangle : mesh.triangles)
      for (Vector& p : triangle) p = turned(p);
  };
  turn_mesh(pair.moving);
  for (DrawnMesh& mesh : pair.fixed) turn_mesh(mesh);
  pair.way = turned(pair.way);
  return pair;
}

}  // namespace haptic::sim
