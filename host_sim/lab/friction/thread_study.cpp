// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_sim/lab/friction/fit_scenes.hpp"
#include "host_sim/lab/friction/friction_studies.hpp"
#include "host_sim/lab/strangers/tried_scene.hpp"

namespace haptic::sim {
namespace {

constexpr double kThreadStiffness_n_per_m = 800, kPress_n = 1, kClearance_m = 1e-4;
/// Of the hand over the place where the flanks meet, in all.
constexpr double kFree_m = 2e-4;
constexpr double kNutPressed_s = 0.3, kTurns_s = 0.4, kJudged_s = 0.75, kEnd_s = 1.3;
constexpr double kMostTorque = 3, kMostLag_rad = 0.01;
/// Half the angle of the flanks of an ISO thread, and twice the depth of its middle in pitches.
constexpr double kFlank_rad = std::numbers::pi / 6, kMiddleDepth = 0.6495;

struct ThreadSize {
  const char* name;
  double diameter_m, pitch_m;
};
constexpr ThreadSize kThreadSizes[] = {
    {"M3", 3e-3, 5e-4}, {"M5", 5e-3, 8e-4}, {"M10", 1e-2, 1.5e-3}, {"M16", 1.6e-2, 2e-3}};

struct ThreadCell {
  ThreadSize size{};
  std::uint32_t segments = 0;
  double friction = 0, speed_rad_per_s = 0;
  double axial_n = 0, screw_nm = 0, mean_nm = 0, most_nm = 0, lag_rad = 0;
  std::size_t ticks = 0, behind = 0, held = 0;

  [[nodiscard]] bool right() const {
    return most_nm <= kMostTorque * screw_nm && std::abs(lag_rad) <= kMostLag_rad;
  }
};

Rotation turn_of(const MotionSample& sample) {
  return {sample.q_wxyz[0], sample.q_wxyz[1], sample.q_wxyz[2], sample.q_wxyz[3]};
}

std::string nut_text(const ThreadCell& cell) {
  std::string text;
  for (const bool moving : {true, false}) {
    text += tools::formatted(
        "[%s]\nshape = \"%s\"\nmaterial = \"%s\"\nsize = \"%s\"\nclearance_m = %g\nsegments = %u\n",
        moving ? "moving" : "[static]", moving ? "nut" : "thread", moving ? "a" : "b",
        cell.size.name, kClearance_m, cell.segments);
    if (!moving) text += "turns = 8\n";
  }
  return text;
}

ThreadCell run_thread(ThreadCell cell, const FrictionSize& size) {
  const bool more = size.fault == FrictionFault::kCoefficient;
  TriedScene tried(
      scene_text(nut_text(cell), kThreadStiffness_n_per_m,
                 more ? 4 * cell.friction + 0.5 : cell.friction, 0, size.units(kLeastWorkUnits)),
      {});
  std::vector<MotionSample> motion;
  const auto turned_rad = [&](double t) {
    return cell.speed_rad_per_s * std::max(t - kTurns_s, 0.0);
  };
  for (double t = 0; t < kEnd_s; t += 1e-3) {
    const double down_m =
        std::min(t / kNutPressed_s, 1.0) * (kPress_n / kThreadStiffness_n_per_m + kFree_m) +
        cell.size.pitch_m * turned_rad(t) / (2 * std::numbers::pi);
    motion.push_back(sample_at(t, {0, 0, -down_m},
                               Rotation(Eigen::AngleAxisd(-turned_rad(t), Vector::UnitZ()))));
  }
  const std::vector<PlayedTick> ticks = tried.play(motion);
  std::size_t judged = 0;
  for (std::size_t k = 0; k < ticks.size(); ++k) {
    cell.ticks += 1;
    cell.behind += (ticks[k].flags & kFlagBehind) != 0 ? 1u : 0u;
    cell.held += (ticks[k].flags & kFlagHeld) != 0 ? 1u : 0u;
    if (motion[k].t_s < kJudged_s) continue;
    judged += 1;
    cell.axial_n += ticks[k].force_n[2];
    cell.mean_nm += ticks[k].torque_nm[2];
    cell.most_nm = std::max(cell.most_nm, ticks[k].torque_nm.norm());
  }
  cell.axial_n /= static_cast<double>(judged);
  cell.mean_nm /= static_cast<double>(judged);
  const Rotation shown = turn_of(*ticks.back().felt), goal = turn_of(motion.back());
  const Rotation left = goal * shown.conjugate();
  cell.lag_rad = 2 * std::atan2(left.z(), left.w());
  cell.lag_rad = std::remainder(cell.lag_rad, 2 * std::numbers::pi);
  // On the middle of the flanks; pressed the way it turns, friction is against both. Where they are
  // about equal, the pitch's own torque is what a hand may feel.
  const double middle_m = cell.size.diameter_m - kMiddleDepth * cell.size.pitch_m;
  const double lead = std::atan(cell.size.pitch_m / (std::numbers::pi * middle_m));
  const double rubs = std::atan(cell.friction / std::cos(kFlank_rad));
  cell.screw_nm =
      cell.axial_n * middle_m / 2 * std::max(std::tan(lead), std::abs(std::tan(rubs - lead)));
  return cell;
}

}  // namespace

PartReport thread_study(const FrictionSize& size, const RunOptions& options) {
  std::vector<std::uint32_t> segments{16, 32, 64};
  std::vector<double> speeds{1, 2, 3, 6}, frictions{0, 0.15, 0.3};
  std::vector<ThreadSize> sizes(std::begin(kThreadSizes), std::end(kThreadSizes));
  if (size.is_short) {
    segments = {16};
    speeds = {1};
    frictions = {0.15};
    sizes = {kThreadSizes[2]};
  }
  std::vector<ThreadCell> cells;
  for (const ThreadSize& nut : sizes) {
    for (const std::uint32_t count : segments) {
      for (const double friction : frictions) {
        for (const double speed : speeds) {
          ThreadCell cell;
          cell.size = nut;
          cell.segments = count;
          cell.friction = friction;
          cell.speed_rad_per_s = speed;
          cells.push_back(cell);
        }
      }
    }
  }
  run_shards(
      cells.size(), options, "threads", [] { return 0; },
      [&](int, std::size_t k) { cells[k] = run_thread(cells[k], size); });
  PartReport report;
  report.title = "Nuts on their bolts";
  ReportTable table(
      "size,segments,friction,speed_rad_per_s,axial_n,screw_nm,mean_nm,most_nm,lag_rad,ticks,"
      "behind,"
      "held,right");
  report.markdown =
      table_head({"size", "segments", "friction", "rad/s", "pressed by, N", "screw, mN m",
                  "mean, mN m", "largest, mN m", "lag, mrad", "behind, per 1000", ""});
  std::size_t wrong = 0;
  for (const ThreadCell& c : cells) {
    wrong += c.right() ? 0u : 1u;
    table.add({c.size.name, c.segments, c.friction, c.speed_rad_per_s, c.axial_n, c.screw_nm,
               c.mean_nm, c.most_nm, c.lag_rad, c.ticks, c.behind, c.held, yes_or_no(c.right())});
    report.markdown += table_row(
        {c.size.name, std::to_string(c.segments), short_number(c.friction, 3),
         short_number(c.speed_rad_per_s, 3), fixed(c.axial_n, 3), fixed(1e3 * c.screw_nm, 3),
         fixed(1e3 * c.mean_nm, 3), fixed(1e3 * c.most_nm, 3), fixed(1e3 * c.lag_rad, 3),
         fixed(1e3 * static_cast<double>(c.behind) / static_cast<double>(c.ticks), 0),
         c.right() ? "" : "WRONG"});
  }
  report.passed = wrong == 0;
  report.markdown += tools::formatted(
      "\n%zu of %zu wrong: a torque above %g times that of screw mechanics, or a lag of more than "
      "%g mrad at the end.\n",
      wrong, cells.size(), kMostTorque, 1e3 * kMostLag_rad);
  report.files = {{"threads.csv", table.csv()}};
  return report;
}

}  // namespace haptic::sim
