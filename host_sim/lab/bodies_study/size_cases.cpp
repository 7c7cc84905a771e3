// SPDX-License-Identifier: Apache-2.0
// One to eight boxes that hands press on a floor, on each other and against a wall.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_sim/lab/bodies_study/cost_cases.hpp"
#include "host_sim/lab/bodies_study/study_bench.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"

namespace haptic::sim {
namespace {

constexpr double kHalfX_m = 0.015, kHalfY_m = 0.012, kHalfZ_m = 0.010;
constexpr double kPressedBy_m = 2e-3, kPressedAfter_s = 0.1;
constexpr double kAbove_m = 1e-4;  ///< over what a box is pressed on, at the start
constexpr double kBeside_m = 0.08, kInAir_m = 0.2;
constexpr std::size_t kSizes[] = {1, 2, 3, 4, 8};
constexpr double kSizeRate_hz = 1000;

enum class Arrangement : std::uint8_t { kApart, kBeside, kStack, kCorner };

double sine(double hz, double t_s) { return std::sin(2 * std::numbers::pi * hz * t_s); }
double pressed_by_m(double t_s) { return kPressedBy_m * std::min(1.0, t_s / kPressedAfter_s); }

/// The goal of box `k` of `count`; no two of them move alike.
BodyPlace size_goal(Arrangement arrangement, std::size_t k, std::size_t count, double t_s) {
  const double press = pressed_by_m(t_s), number = static_cast<double>(k);
  const double side = k % 2 == 0 ? 1 : -1;
  const double slide_x = side * 1e-3 * sine(0.8 + 0.05 * number, t_s);
  const double slide_y = side * 2e-3 * sine(0.7 + 0.05 * number, t_s);
  const double turn = side * 0.1 * sine(0.5 + 0.05 * number, t_s);
  const bool in_corner = arrangement == Arrangement::kCorner;
  const Rotation turned = turn_about(Vector::UnitZ(), in_corner ? 0.1 * turn : turn);
  if (arrangement == Arrangement::kApart || arrangement == Arrangement::kBeside) {
    const double x = kBeside_m * (number - 0.5 * static_cast<double>(count - 1));
    const double z = arrangement == Arrangement::kApart ? kInAir_m : kHalfZ_m + kAbove_m;
    return {{x + slide_x, slide_y, z - press}, turned};
  }
  const double z = (2 * number + 1) * kHalfZ_m + (number + 1) * kAbove_m - press;
  return {{in_corner ? kAbove_m - press : slide_x, slide_y, z}, turned};
}

BodiesCostCase size_case(Arrangement arrangement, std::size_t count) {
  struct Words {
    const char* name;
    std::size_t contacts_of_body;
  };
  constexpr Words kWords[] = {{"in the air", 0}, {"on a table", 1}, {"stack", 1}, {"corner", 2}};
  const Words& words = kWords[static_cast<std::size_t>(arrangement)];
  BodiesCostCase of;
  of.name = std::string(words.name) + ", " + std::to_string(count);
  of.contacts = words.contacts_of_body * count;
  of.work_units = tools::work_units_at(kSizeRate_hz, 0, 0, 0, false);
  of.goals = [arrangement, count](double t_s) {
    std::vector<BodyPlace> goals;
    for (std::size_t k = 0; k < count; ++k) goals.push_back(size_goal(arrangement, k, count, t_s));
    return goals;
  };
  const std::vector<BodyPlace> starts = of.goals(0);
  for (std::size_t k = 0; k < count; ++k) {
    of.scene.bodies.push_back(study_body("box " + std::to_string(k + 1), BodyRole::kHand,
                                         one_box(kHalfX_m, kHalfY_m, kHalfZ_m), starts[k].p, 0.01));
  }
  of.scene.name = "size";
  of.scene.standing = {box_solid("floor", {-0.4, -0.1, -0.02}, {0.4, 0.1, 0})};
  if (arrangement == Arrangement::kCorner)
    of.scene.standing.push_back(box_solid("wall", {-0.4, -0.1, 0}, {-kHalfX_m, 0.1, 0.2}));
  return of;
}

}  // namespace

std::vector<BodiesCostCase> bodies_size_cases() {
  std::vector<BodiesCostCase> cases;
  for (const Arrangement arrangement :
       {Arrangement::kApart, Arrangement::kBeside, Arrangement::kStack, Arrangement::kCorner}) {
    for (const std::size_t count : kSizes) cases.push_back(size_case(arrangement, count));
  }
  return cases;
}

}  // namespace haptic::sim
