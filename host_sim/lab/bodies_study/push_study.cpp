// SPDX-License-Identifier: Apache-2.0
// A driver pushes a hand's part in the air: straight, and as a bar that turns.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_sim/lab/bodies_study/study_bench.hpp"

namespace haptic::sim {
namespace {

constexpr double kPushedHalf_m = 0.015;
/// Faces meet when the driver's middle is this far from the hand's.
constexpr double kTouch_m = 2 * kPushedHalf_m;
constexpr double kPushed_m = 8e-3;  ///< as far as the part is taken from its hand
constexpr double kStartGap_m = 5e-3;
constexpr double kHand_n_per_m = 1000, kPushTick_s = 1e-3;
constexpr double kNoticed_m = 1e-4;  ///< a lag that someone may see
constexpr int kPushHeldTicks = 200;
constexpr double kBarHalfLength_m = 0.06, kBarHalfWidth_m = 5e-3;

struct PushFigures {
  double lag_m = 0, lag_rad = 0, force_n = 0;
  std::size_t ticks = 0, behind = 0;

  void note(const StudyBench& bench) {
    lag_m = std::max(lag_m, bench.lag_m(1));
    lag_rad = std::max(lag_rad, bench.lag_rad(1));
    behind += bench.lag_m(1) + kBarHalfLength_m * bench.lag_rad(1) > kNoticed_m ? 1u : 0u;
    ticks += 1;
    force_n = std::max(force_n, bench.spring_n(0).norm());
  }
};

/// `most_lag_m`, `most_step_n`: bounds; infinite where there is none.
StudyRow push_row_of(const std::string& name, const PushFigures& f, const StudyBench& bench,
                     double most_lag_m, double most_step_n) {
  const double none = StudyFigure::kNone;
  StudyRow row;
  row.name = name;
  row.figures = {
      {"lag_um", "driver's largest lag, um", 1e6 * f.lag_m, -none, 1e6 * most_lag_m},
      {"lag_urad", "and turn, urad", 1e6 * f.lag_rad},
      {"behind_ticks", "ticks behind / of", static_cast<double>(f.behind)},
      {"ticks", "ticks behind / of", static_cast<double>(f.ticks)},
      {"hand_n", "hand's largest force, N", f.force_n},
      {"largest_step_n", "its largest step a tick, N", bench.largest_step_n(), -none, most_step_n},
      bench.depth_figure()};
  return row;
}

StudyRow straight_row(double speed_m_per_s, std::optional<BodiesFault> fault) {
  BodiesScene scene;
  scene.name = "push";
  const std::vector<Solid> box = one_box(kPushedHalf_m, kPushedHalf_m, kPushedHalf_m);
  const Vector start(-kTouch_m - kStartGap_m, 3e-3, 2e-3);
  scene.bodies = {study_body("box", BodyRole::kHand, box, Vector::Zero(), 0.05),
                  study_body("pusher", BodyRole::kDriver, box, start, 0.05)};
  StudyBench bench(scene, 0, {{Vector::Zero()}, {start}}, fault);
  PushFigures f;
  const double way_m = kStartGap_m + kPushed_m;
  const int ticks = static_cast<int>(std::ceil(way_m / (kPushTick_s * speed_m_per_s)));
  const auto tick = [&](double along_m) {
    static_cast<void>(bench.tick({{Vector::Zero()}, {start + Vector(along_m, 0, 0)}}));
    f.note(bench);
  };
  const auto way_at = [&](int k) { return std::min(way_m, kPushTick_s * speed_m_per_s * k); };
  for (int k = 0; k < ticks + kPushHeldTicks; ++k) tick(way_at(k));
  for (int k = 0; k < ticks + kPushHeldTicks; ++k) tick(way_m - way_at(k));
  // The hand's spring alone, at the speed that its part is taken with.
  const double step_n = kHand_n_per_m * kPushTick_s * speed_m_per_s + bound_in(1e-3, 0.1);
  return push_row_of(tools::formatted("straight, %g m/s", speed_m_per_s), f, bench,
                     bound_in(1e-6, 1e-4), step_n);
}

/// A turn and a half about the bar's middle: the part is taken along and slides through there.
StudyRow turning_row(double speed_rad_per_s, std::optional<BodiesFault> fault) {
  BodiesScene scene;
  scene.name = "turning bar";
  const Vector hand(0.03, 0.02, 0);
  scene.bodies = {
      study_body("box", BodyRole::kHand, one_box(0.01, 0.01, 0.01), hand, 0.1),
      study_body("bar", BodyRole::kDriver, one_box(kBarHalfLength_m, kBarHalfWidth_m, 0.012),
                 Vector::Zero(), 0.01)};
  StudyBench bench(scene, 0, {{hand}, {Vector::Zero()}}, fault);
  PushFigures f;
  const double whole_rad = 3 * std::numbers::pi;
  const int ticks = static_cast<int>(std::ceil(whole_rad / (kPushTick_s * speed_rad_per_s)));
  for (int k = 0; k < ticks + kPushHeldTicks; ++k) {
    const double angle = std::min(whole_rad, kPushTick_s * speed_rad_per_s * k);
    static_cast<void>(bench.tick({{hand}, {Vector::Zero(), turn_about(Vector::UnitZ(), angle)}}));
    f.note(bench);
  }
  return push_row_of(tools::formatted("bar, %g rad/s", speed_rad_per_s), f, bench,
                     StudyFigure::kNone, StudyFigure::kNone);
}

}  // namespace

BodiesStudy push_study(const BodiesStudySize& size) {
  BodiesStudy study;
  study.name = "push";
  study.title = "Push";
  study.about =
      "A driver of ratio 1e4 pushes a hand's part in the air: straight, 8 mm from the hand's goal "
      "and\nback; or as a bar of 120 mm that makes one and a half turns about its middle. Behind: "
      "by more than\n0.1 mm, with the turn at a lever of 60 mm.\n";
  for (const double speed : {0.05, 0.25, 2.0}) {
    if (size.is_short && speed < 0.25) continue;
    study.rows.push_back(straight_row(speed, size.fault));
  }
  for (const double speed : {6.0, 30.0}) study.rows.push_back(turning_row(speed, size.fault));
  return study;
}

}  // namespace haptic::sim
