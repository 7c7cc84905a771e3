// SPDX-License-Identifier: Apache-2.0
// A driver comes down on a hand's part that lies on a table, farther than there is room, and goes
// back.
#include <algorithm>
#include <cmath>

#include "host_sim/lab/bodies_study/study_bench.hpp"

namespace haptic::sim {
namespace {

constexpr double kHalf_m = 0.02, kHalfHeight_m = 0.01;
constexpr double kSqueezePress_m = 2e-3;
/// Heights of the driver's middle: where it waits, where it meets the part, and how much deeper it
/// is told to go.
constexpr double kWait_m = 0.06, kMeet_m = 3 * kHalfHeight_m, kNoRoom_m = 0.022;
constexpr double kFree_m = 1e-3;  ///< above the part: nothing is held
constexpr int kBeforeTicks = 200, kSqueezedTicks = 200, kAfterTicks = 200;

/// Reported by a driver with a limit: at most so much more, for rounding.
constexpr double kPushRounding_n = 1e-3;

struct SqueezeCase {
  double ratio = 1e4, push_n = 0, speed_m_per_s = 0;
};

struct SqueezeFigures {
  double free_lag_m = 0, squeezed_lag_m = 0, after_lag_m = 0;
  double before_n = 0, squeezed_n = 0, after_n = 0, reported_n = 0;
};

BodiesScene squeeze_scene(const SqueezeCase& of) {
  BodiesScene scene;
  scene.name = "squeeze";
  scene.bodies = {study_body("box", BodyRole::kHand, one_box(kHalf_m, kHalf_m, kHalfHeight_m),
                             {0, 0, kHalfHeight_m + 1e-4}, 0.01),
                  study_body("press", BodyRole::kDriver, one_box(kHalf_m, kHalf_m, kHalfHeight_m),
                             {5e-3, 4e-3, kWait_m}, kWait_m)};
  scene.standing = {study_table()};
  scene.driver = {of.ratio, of.push_n};
  return scene;
}

StudyRow squeeze_row(const SqueezeCase& of, std::optional<BodiesFault> fault) {
  const BodiesScene scene = squeeze_scene(of);
  StudyBench bench(scene, 0, {{scene.bodies[0].start}, {scene.bodies[1].start}}, fault);
  const double way_m = kWait_m - kMeet_m + kNoRoom_m;
  const int way_ticks = static_cast<int>(std::ceil(way_m / (1e-3 * of.speed_m_per_s)));
  SqueezeFigures f;
  const auto tick = [&](double down_m) {
    const BodyPlace hand{{2e-3, 0, kHalfHeight_m - kSqueezePress_m}};
    const BodyPlace press{scene.bodies[1].start - Vector(0, 0, down_m)};
    static_cast<void>(bench.tick({hand, press}));
    if (press.p.z() >= kMeet_m + kFree_m) f.free_lag_m = std::max(f.free_lag_m, bench.lag_m(1));
    f.reported_n = std::max(f.reported_n, bench.contact_n(1).norm());
  };
  const auto way_at = [&](int k) { return std::min(way_m, 1e-3 * of.speed_m_per_s * k); };
  // The hand's own way to the table is no step that the driver makes.
  for (int k = 0; k < kBeforeTicks; ++k) tick(0);
  bench.forget_steps();
  f.before_n = bench.spring_n(0).norm();
  for (int k = 1; k <= way_ticks + kSqueezedTicks; ++k) tick(way_at(k));
  f.squeezed_lag_m = bench.lag_m(1);
  f.squeezed_n = bench.spring_n(0).norm();
  for (int k = 1; k <= way_ticks + kAfterTicks; ++k) tick(way_m - way_at(k));
  f.after_lag_m = bench.lag_m(1);
  f.after_n = bench.spring_n(0).norm();

  // A soft driver presses the part aside no more than a stiff one: all ratios keep the bound.
  const double same_n = bound_in(1e-3, 0.04);
  const double room_m = bound_in(1e-5, 1e-4);
  const double most_n = of.push_n > 0 ? of.push_n + kPushRounding_n : StudyFigure::kNone;
  const char* const force = "its change squeezed / afterwards, mN";
  const double none = StudyFigure::kNone;
  StudyRow row;
  row.name = tools::formatted("ratio %g, %s, %g m/s", of.ratio,
                              of.push_n > 0 ? "100 N" : "no limit", of.speed_m_per_s);
  row.figures = {
      {"free_lag_um", "lag while free, um", 1e6 * f.free_lag_m, -none, bound_in(1, 100)},
      {"squeezed_lag_mm", "squeezed, mm", 1e3 * f.squeezed_lag_m},
      {"squeezed_off_um", "off by, um", 1e6 * (f.squeezed_lag_m - kNoRoom_m), -1e6 * room_m,
       1e6 * room_m},
      {"after_lag_nm", "afterwards, nm", 1e9 * f.after_lag_m, -none, bound_in(1, 1000)},
      {"before_n", "hand's force, N", f.before_n},
      {"squeezed_mn", force, 1e3 * (f.squeezed_n - f.before_n), -1e3 * same_n, 1e3 * same_n},
      {"after_mn", force, 1e3 * (f.after_n - f.before_n), -1e3 * same_n, 1e3 * same_n},
      {"largest_step_n", "largest step a tick, N", bench.largest_step_n(), -none,
       bound_in(5e-3, 0.1)},
      {"reported_n", "largest force on the driver, N", f.reported_n, -none, most_n},
      bench.depth_figure()};
  return row;
}

}  // namespace

BodiesStudy squeeze_study(const BodiesStudySize& size) {
  BodiesStudy study;
  study.name = "squeeze";
  study.title = "Squeeze";
  study.about =
      "A driver comes down on a part that a hand presses on a table with 2 N, 22 mm farther than\n"
      "there is room, stays for 0.2 s and goes back.\n";
  for (const double ratio : {1e4, 1e2, 1e6}) {
    for (const double push_n : {100.0, 0.0}) {
      for (const double speed : {0.25, 2.0}) {
        if (size.is_short && (ratio != 1e4 || speed != 0.25)) continue;
        study.rows.push_back(squeeze_row({ratio, push_n, speed}, size.fault));
      }
    }
  }
  return study;
}

}  // namespace haptic::sim
