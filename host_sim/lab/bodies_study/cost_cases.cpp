// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/bodies_study/cost_cases.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_sim/lab/bodies_study/study_bench.hpp"

namespace haptic::sim {
namespace {

constexpr double kPressed_m = 2e-3, kPressing_s = 0.1;
constexpr double kBoxX_m = 0.015, kBoxY_m = 0.012, kBoxZ_m = 0.010;
constexpr double kStartOver_m = 1e-4;  ///< over what a box is pressed on

double wave(double hz, double t_s) { return std::sin(2 * std::numbers::pi * hz * t_s); }
double pressed_m(double t_s) { return kPressed_m * std::min(1.0, t_s / kPressing_s); }

/// Lies on the plane z = 0, is pressed on it and slid.
BodyPlace sliding_box(double t_s) {
  return {{0.010 * wave(1, t_s), 0.006 * wave(0.7, t_s), kBoxZ_m + kStartOver_m - pressed_m(t_s)},
          turn_about(Vector::UnitZ(), 0.2 * wave(0.5, t_s))};
}
/// Its top is the plane z = 0 of its own axes, moved 10 mm below it.
BodyPlace moving_plate(double t_s) {
  const BodyPlace turned{{0.010 * wave(0.8, t_s), 0, 0.008 * wave(1.1, t_s)},
                         turn_about(Vector::UnitX(), 0.1 * wave(0.9, t_s)) *
                             turn_about(Vector::UnitZ(), 0.2 * wave(0.6, t_s))};
  return carried_by(turned, {{0, 0, -0.010}});
}

std::vector<BodyPlace> one_goals(double t_s) { return {sliding_box(t_s)}; }

std::vector<BodyPlace> plate_goals(double t_s) {
  const BodyPlace plate = moving_plate(t_s);
  const BodyPlace top = carried_by(plate, {{0, 0, 0.010}});
  return {carried_by(top, sliding_box(t_s)), plate};
}

/// A box on another one on the table, and a driver that pushes both aside.
std::vector<BodyPlace> three_goals(double t_s) {
  const double press = pressed_m(t_s), aside = 2e-3 * wave(0.8, t_s);
  return {{{aside, 1e-3 * wave(1, t_s), kBoxZ_m + kStartOver_m - press}},
          {{-aside, 2e-3 * wave(0.7, t_s), 3 * kBoxZ_m + 3 * kStartOver_m - press}},
          {{kBoxX_m + 0.010 + 3e-3 - 3 * press + 2e-3 * wave(0.6, t_s), 0, 0.022}}};
}

std::vector<BodyPlace> apart_goals(double t_s) {
  const BodyPlace left{{-0.15, 0, 0}}, right{{0.15, 0, 0}};
  return {carried_by(left, sliding_box(t_s)), carried_by(right, moving_plate(t_s))};
}

BodiesScene cost_scene_of(std::vector<FuzzBody> bodies, bool has_table) {
  BodiesScene scene;
  scene.name = "cost";
  scene.bodies = std::move(bodies);
  if (has_table) scene.standing = {study_table()};
  return scene;
}

FuzzBody cost_box(const char* name, double z = kBoxZ_m) {
  return study_body(name, BodyRole::kHand, one_box(kBoxX_m, kBoxY_m, kBoxZ_m), {0, 0, z}, 0.05);
}
FuzzBody cost_plate(BodyRole role) {
  return study_body("plate", role, one_box(0.08, 0.08, 0.010), {0, 0, -0.010}, 0.05);
}

}  // namespace

std::vector<BodiesCostCase> bodies_cost_cases() {
  const auto hand = BodyRole::kHand, driver = BodyRole::kDriver;
  const BodiesScene one = cost_scene_of({cost_box("box")}, true);
  FuzzBody far = cost_plate(driver);
  far.range.reach_m = Vector(0.2, 0, 0);
  const std::vector<BodiesCostCase> cases{
      {"one body, law of one part", true, 0, one, one_goals},
      {"one body", false, 0, one, one_goals},
      {"hand and driver", false, 0, cost_scene_of({cost_box("box"), cost_plate(driver)}, false),
       plate_goals},
      {"two hands", false, 0, cost_scene_of({cost_box("box"), cost_plate(hand)}, false),
       plate_goals},
      {"three bodies, four contacts", false, 0,
       cost_scene_of(
           {cost_box("lower"), cost_box("upper", 3 * kBoxZ_m),
            study_body("pusher", driver, one_box(0.010, 0.030, 0.020), {0.03, 0, 0.022}, 0.02)},
           true),
       three_goals},
      {"two bodies far apart", false, 0, cost_scene_of({cost_box("box"), far}, false),
       apart_goals}};
  std::vector<BodiesCostCase> all;
  for (const double friction : {0.0, 0.3}) {
    for (BodiesCostCase of : cases) {
      of.friction = friction;
      if (friction > 0) of.name += tools::formatted(", friction %g", friction);
      all.push_back(std::move(of));
    }
  }
  return all;
}

}  // namespace haptic::sim
