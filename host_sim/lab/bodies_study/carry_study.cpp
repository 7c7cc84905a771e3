// SPDX-License-Identifier: Apache-2.0
// A peg that a hand holds against floor and wall of a hole which a driver carries and turns.
#include <algorithm>
#include <cmath>

#include "host_sim/lab/bodies_study/study_bench.hpp"

namespace haptic::sim {
namespace {

constexpr double kPegWidth_m = 0.0097, kPegHalfLength_m = 0.03, kHoleHalf_m = 0.01;
constexpr double kFirstHeight_m = 0.035;
/// The hand's goal in the hole. A peg that stands on the floor has its middle at -10 mm, and 0.3 mm
/// of room to the walls.
constexpr double kGoalHeight_m = -0.012, kAside_m = 1e-3;
constexpr double kInside_s = 1, kCarried_s = 2.5, kStopped_s = 0.6, kRest_s = 0.3;
constexpr double kLower_m_per_s = 0.06, kAsideFrom_s = 0.85, kAsideIn_s = 0.1;

struct CarryCase {
  double speed_m_per_s, speed_rad_per_s, turn_rad;
};

struct CarryFigures {
  double lag_m = 0, lag_rad = 0, hand_n = 0, unrest_n = 0, ripple_n = 0;
};

/// An arc there and back, at both speeds in its middle, level at both ends.
BodyPlace hole_at(const CarryCase& of, double t_s) {
  const double rate = of.speed_rad_per_s / of.turn_rad;
  const double swing = std::sin(rate * std::clamp(t_s - kInside_s, 0.0, kCarried_s));
  const double reach_m = of.speed_m_per_s / rate;
  return {{reach_m * swing, 0, 0}, turn_about(Vector::UnitY(), of.turn_rad * swing)};
}

StudyRow carry_row(const CarryCase& of, const BodiesStudySize& size) {
  BodiesScene scene;
  scene.name = "carry";
  const Vector first(0, 0, kFirstHeight_m);
  scene.bodies = {
      study_body("peg", BodyRole::kHand, one_box(kPegWidth_m, kPegWidth_m, kPegHalfLength_m), first,
                 0.2),
      study_body("hole", BodyRole::kDriver, five_piece_hole(kHoleHalf_m), Vector::Zero(), 0.2)};
  StudyBench bench(scene, 0, {{first}, {Vector::Zero()}}, size.fault);
  CarryFigures f;
  Vector still = Vector::Zero(), low = Vector::Zero(), high = Vector::Zero();
  const double carried_s = size.is_short ? kCarried_s / 2 : kCarried_s;
  const int stop = static_cast<int>(1e3 * (kInside_s + carried_s));
  const int rest = stop + static_cast<int>(1e3 * (kStopped_s - kRest_s));
  const int end = stop + static_cast<int>(1e3 * kStopped_s);
  for (int t = 0; t < end; ++t) {
    const double s = 1e-3 * std::min(t, stop);
    const BodyPlace hole = hole_at(of, s);
    const double height = std::max(kGoalHeight_m, kFirstHeight_m - kLower_m_per_s * s);
    const double aside = kAside_m * std::clamp((s - kAsideFrom_s) / kAsideIn_s, 0.0, 1.0);
    const BodyPlace goal = carried_by(hole, {{aside, 0, height}});
    static_cast<void>(bench.tick({goal, hole}));
    f.lag_m = std::max(f.lag_m, bench.lag_m(1));
    f.lag_rad = std::max(f.lag_rad, bench.lag_rad(1));
    const Vector force = hole.q.conjugate() * bench.spring_n(0);
    f.hand_n = std::max(f.hand_n, force.norm());
    if (s < kInside_s - 2e-3) continue;
    if (s < kInside_s) {
      still = force;
    } else {
      f.unrest_n = std::max(f.unrest_n, (force - still).norm());
    }
    if (t == rest) low = high = force;
    if (t < rest) continue;
    low = low.cwiseMin(force);
    high = high.cwiseMax(force);
  }
  f.ripple_n = (high - low).norm();

  const double none = StudyFigure::kNone;
  StudyRow row;
  row.name = tools::formatted("%g m/s, %g rad/s", of.speed_m_per_s, of.speed_rad_per_s);
  row.figures = {{"lag_um", "hole's largest lag, um", 1e6 * f.lag_m, -none, bound_in(1, 100)},
                 {"lag_urad", "and turn, urad", 1e6 * f.lag_rad},
                 {"hand_n", "hand's largest force, N", f.hand_n},
                 {"unrest_n", "its change while carried, as the hole sees it, N", f.unrest_n},
                 {"ripple_n", "ripple at rest, N", f.ripple_n, -none, bound_in(1e-6, 1e-3)},
                 bench.depth_figure()};
  return row;
}

}  // namespace

BodiesStudy carry_study(const BodiesStudySize& size) {
  BodiesStudy study;
  study.name = "carry";
  study.title = "Carry";
  study.about =
      "A peg that a hand presses on the floor (2 N) and a wall (0.7 N) of a hole of five pieces, "
      "0.3 mm of\nroom on either side; a driver of ratio 1e4 carries the hole along an arc and "
      "turns it.\n";
  for (const CarryCase& of :
       {CarryCase{0.22, 1, 0.6}, CarryCase{0.43, 2, 0.6}, CarryCase{0.87, 4, 0.6}}) {
    if (size.is_short && of.speed_rad_per_s < 4) continue;
    study.rows.push_back(carry_row(of, size));
  }
  return study;
}

}  // namespace haptic::sim
