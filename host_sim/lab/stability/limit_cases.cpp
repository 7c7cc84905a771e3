// SPDX-License-Identifier: Apache-2.0
// Starts inside an obstacle, limits of the pull and jumps of the device; friction.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_sim/lab/stability/proxy_cases.hpp"
#include "host_sim/shapes/contact_case.hpp"

namespace haptic::sim {
namespace {

using std::numbers::pi;
constexpr double kFree_m = -2e-7;

CoupledScene box_on(tools::Body fixed) {
  CoupledScene scene;
  scene.moving = sample_box();
  scene.statics.push_back(std::move(fixed));
  return scene;
}

/// Ticks until the proxy is free, started at rest in `pose`.
std::vector<Figure> recovery_figures(const PathPose& pose, double depth_m, double ticks) {
  TimedPath path;
  path.pose = [pose](double) { return pose; };
  path.duration_s = 0.03;
  path.approach_s = 0;
  const Trace trace = run_trace(box_on(sample_block()), LawId::kProxy, path);
  const auto ticked = trace.path();
  std::size_t free_at = 0;
  while (free_at < ticked.size() && ticked[free_at].gap_m < kFree_m) ++free_at;
  bool stays = free_at < ticked.size();
  for (std::size_t k = free_at; k < ticked.size(); ++k) stays = stays && ticked[k].gap_m >= kFree_m;
  const double flagged = (ticked.front().flags & kFlagRecovery) != 0 ? 1 : 0;
  return {
      at_most("ticks until free", ticks, static_cast<double>(free_at + 1)),
      near_to("stays free", 1, stays ? 1 : 0, 0), near_to("flag at the start", 1, flagged, 0),
      near_to("gap after a tick (m)", -std::max(depth_m - 6e-4, 0.0), ticked.front().gap_m, 2e-5)};
}

PathPose flat_at(double depth_m) { return {{0, 0, kBoxHalf_m[2] - depth_m}, Rotation::Identity()}; }

PathPose corner_down_at(double depth_m) {
  const Rotation q = turn_about(0.3, Vector::UnitX()) * turn_about(0.25, Vector::UnitY());
  double lowest = 0;
  for (int k = 0; k < 8; ++k) {
    const Vector v((k & 1) != 0 ? kBoxHalf_m[0] : -kBoxHalf_m[0],
                   (k & 2) != 0 ? kBoxHalf_m[1] : -kBoxHalf_m[1],
                   (k & 4) != 0 ? kBoxHalf_m[2] : -kBoxHalf_m[2]);
    lowest = std::min(lowest, (q * v).z());
  }
  return {{0, 0, -lowest - depth_m}, q};
}

std::vector<Figure> full_turn_figures() {
  constexpr double kLimit_rad = 0.3, kSpeed_rad_per_s = 1.6;
  CoupledScene scene = peg_scene(1e-4);
  scene.max_rotation_rad = kLimit_rad;
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    return {{0, 0, kPegHalfLength_m - 0.02}, turn_about(kSpeed_rad_per_s * t, Vector::UnitZ())};
  };
  path.duration_s = 2 * pi / kSpeed_rad_per_s;
  path.retreat_w = {0, 0, 0.04};
  const Trace trace = run_trace(scene, LawId::kProxy, path);
  double largest_nm = 0;
  for (const TraceTick& tick : trace.path())
    largest_nm = std::max(largest_nm, tick.torque_nm.norm());
  const double limit_nm = scene.k_r_nm_per_rad * kLimit_rad;
  // Wound up once, then dragged: what the spring holds at the end is not lost.
  const double dragged_j = limit_nm * (2 * pi - kLimit_rad / 2);
  return {
      near_to("largest torque (N m)", limit_nm, largest_nm, 1e-6),
      at_most("dtau (N m)", 8e-4, largest_steps(trace.path()).torque_nm),
      near_to("work against the drag (J)", dragged_j, hand_work_j(trace.path()), 0.03 * dragged_j),
      {"gap (m)", 0, worst_gap_m(trace.ticks), kFree_m, 1}};
}

std::vector<Figure> deep_push_figures() {
  CoupledScene scene = box_on(sample_block());
  scene.max_translation_m = 0.008;
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    return {{0, 0, kBoxHalf_m[2] + 0.001 - 0.03 * t}, Rotation::Identity()};
  };
  path.duration_s = 0.061 / 0.03;
  path.approach_s = 0.01;
  path.retreat_w = {0, 0, 3e-4};
  const Trace trace = run_trace(scene, LawId::kProxy, path);
  const bool told = (trace.ticks.back().flags & kFlagSaturated) != 0;
  return {near_to("F at 60 mm (N)", 8, trace.ticks.back().force_n.z(), 1e-3),
          at_most("dF (N)", 0.03, largest_steps(trace.path()).force_n),
          near_to("flag", 1, told ? 1 : 0, 0)};
}

std::vector<Figure> teleport_figures() {
  CoupledScene scene = box_on(sample_block());
  scene.max_rotation_rad = 3;
  const PathPose from{{0, 0, 0.2}, Rotation::Identity()};
  const PathPose to{{0.06, 0.08, 0.2}, turn_about(2.5, {1, 2, 2})};
  TimedPath path;
  path.pose = [=](double t) { return t < 0.0105 ? from : to; };
  path.duration_s = 0.2;
  const Trace trace = run_trace(scene, LawId::kProxy, path);
  std::size_t caught = 0;
  while (caught < trace.ticks.size()) {
    const TraceTick& tick = trace.ticks[trace.ticks.size() - 1 - caught];
    if ((tick.proxy.p - to.p).norm() > 1e-6 || tick.proxy.q.angularDistance(to.q) > 1e-6) break;
    ++caught;
  }
  const double ticks = static_cast<double>(trace.ticks.size() - caught - trace.begin) - 11 + 1;
  return {at_most("ticks until caught", 42, ticks)};
}

std::vector<Figure> behind_plate_figures() {
  const CoupledScene scene = box_on(thin_plate(1e-3, 0.3));
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    return {{0, 0, kBoxHalf_m[2] + (t < 0.0105 ? 0.06 : -0.04)}, Rotation::Identity()};
  };
  path.duration_s = 0.2;
  const Trace trace = run_trace(scene, LawId::kProxy, path);
  return {near_to("F (N)", 40, trace.ticks.back().force_n.z(), 0.01),
          near_to("rests on the plate (m)", kBoxHalf_m[2], trace.ticks.back().proxy.p.z(), 1e-6),
          {"gap (m)", 0, worst_gap_m(trace.ticks), kFree_m, 1}};
}

tools::Body wide_floor() { return thin_plate(0.05, 0.1); }

/// 3 mm deep, dragged along x: how far until it slides, and the ratio of the forces then.
std::vector<Figure> drag_figures(double mu) {
  constexpr double kSpeed_m_per_s = 0.02;
  CoupledScene scene = box_on(wide_floor());
  scene.friction = mu;
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    return {{kSpeed_m_per_s * t, 0, kBoxHalf_m[2] - kPush_m}, Rotation::Identity()};
  };
  path.duration_s = 0.4;
  const Trace trace = run_trace(scene, LawId::kProxy, path);
  const auto ticks = trace.path();
  const double stand = ticks.front().proxy.p.x();
  std::size_t moves = 0;
  while (moves < ticks.size() && std::abs(ticks[moves].proxy.p.x() - stand) < 1e-8) ++moves;
  double creep_m = 0;
  for (std::size_t k = 0; k + 1 < moves; ++k)
    creep_m = std::max(creep_m, (ticks[k].proxy.p - ticks[0].proxy.p).norm());
  const TraceTick& end = ticks.back();
  const double held_m = moves < ticks.size() ? ticks[moves].device.p.x() : 1;
  double ripple_n = 0;
  for (const TraceTick& tick : ticks.last(100))
    ripple_n = std::max(ripple_n, (tick.force_n - end.force_n).norm());
  return {near_to("slides from (m)", mu * kPush_m, held_m, 1.01 * kSpeed_m_per_s * kTracePeriod_s),
          near_to("creep before (m)", 0, creep_m, 1e-9),
          near_to("F_t / F_n", mu, -end.force_n.x() / end.force_n.z(), 1e-4),
          near_to("ripple (N)", 0, ripple_n, 1e-9)};
}

/// Once round a circle of 20 mm, sliding.
std::vector<Figure> circle_figures(double mu) {
  CoupledScene scene = box_on(wide_floor());
  scene.friction = mu;
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    const double a = pi * t;
    return {{0.02 * std::cos(a), 0.02 * std::sin(a), kBoxHalf_m[2] - kPush_m},
            Rotation::Identity()};
  };
  path.duration_s = 4;
  const Trace trace = run_trace(scene, LawId::kProxy, path);
  const double work_j = hand_work_j(trace.path().last(2001));
  if (mu == 0) return {near_to("work (J)", 0, work_j, 1.4e-9)};
  return {near_to("work (J)", 0.113, work_j, 0.002)};
}

/// Tremor of 0.1 um, without a period that the ticks could meet.
Vector tremor_m(double t) {
  return 1e-7 * Vector(std::sin(7.13e4 * t), std::sin(9.71e4 * t + 1), std::sin(1.137e5 * t + 2));
}

/// Pressed and spun at 0.5 rad/s with tremor: the torque, its noise, and the force aside.
std::vector<Figure> spin_figures(double mu) {
  CoupledScene scene = box_on(wide_floor());
  scene.friction = mu;
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    const Vector place(0, 0, kBoxHalf_m[2] - kPush_m);
    return {place + tremor_m(t), turn_about(0.5 * t, Vector::UnitZ())};
  };
  path.duration_s = 2.5;
  const Trace trace = run_trace(scene, LawId::kProxy, path);
  const auto ticks = trace.path().last(1500);
  double sum_nm = 0, squares = 0, force_n = 0;
  for (const TraceTick& tick : ticks) {
    const double torque = std::abs(tick.torque_nm.z());
    sum_nm += torque;
    squares += torque * torque;
    force_n += tick.force_n.z();
  }
  const auto count = static_cast<double>(ticks.size());
  const double mean_nm = sum_nm / count, lever_m = std::hypot(kBoxHalf_m[0], kBoxHalf_m[1]);
  const double noise = std::sqrt(std::max(0.0, squares / count - mean_nm * mean_nm)) / mean_nm;
  const double patch_nm = mu * force_n / count * lever_m;
  return {at_most("torque noise (1)", 0.02, noise),
          near_to("torque over that of the corners", 1, mean_nm / patch_nm, 0.03)};
}

/// Dragged in 360 directions at 20 mm/s: largest error of the force along and across the way.
std::vector<Figure> direction_figures(double mu) {
  CoupledScene scene = box_on(wide_floor());
  scene.friction = mu;
  double along = 0, across = 0;
  for (int degree = 0; degree < 360; ++degree) {
    const double a = degree * pi / 180;
    TimedPath path;
    path.pose = [a](double t) -> PathPose {
      return {{0.02 * t * std::cos(a), 0.02 * t * std::sin(a), kBoxHalf_m[2] - kPush_m},
              Rotation::Identity()};
    };
    path.duration_s = mu * kPush_m / 0.02 + 0.1;
    const TraceTick end = run_trace(scene, LawId::kProxy, path).ticks.back();
    const double most_n = mu * end.force_n.z();
    const Vector way(std::cos(a), std::sin(a), 0), aside(-std::sin(a), std::cos(a), 0);
    along = std::max(along, std::abs(-end.force_n.dot(way) / most_n - 1));
    across = std::max(across, std::abs(end.force_n.dot(aside)) / most_n);
  }
  return {at_most("error along the way (1)", 0.02, along),
          at_most("force across the way (1)", 0.03, across)};
}

/// Held for 60 s with tremor, pulled with 0.8 mu N at 45 degrees.
std::vector<Figure> stick_figures(double mu) {
  CoupledScene scene = box_on(wide_floor());
  scene.friction = mu;
  TimedPath path;
  path.pose = [mu](double t) -> PathPose {
    const double pull = 0.8 * std::min(t / 0.2, 1.0) * mu * kPush_m / std::numbers::sqrt2;
    return {Vector(pull, pull, kBoxHalf_m[2] - kPush_m) + tremor_m(t), Rotation::Identity()};
  };
  path.duration_s = 60.3;
  const Trace trace = run_trace(scene, LawId::kProxy, path);
  const auto ticks = trace.path().last(60000);
  double drift_m = 0;
  for (const TraceTick& tick : ticks)
    drift_m = std::max(drift_m, (tick.proxy.p - ticks.front().proxy.p).norm());
  return {near_to("drift in 60 s (m)", 0, drift_m, 0)};
}

/// Tilted in its hole and pushed 8 mm down: how far it lags at most, and what it takes.
std::vector<Figure> jam_figures(double mu, double force_n) {
  const CoupledScene scene = peg_scene(1e-4, mu);
  TimedPath path;
  path.pose = [](double t) -> PathPose {
    const double tilt = 0.08 * std::clamp(t, 0.0, 1.0);
    const double down = 0.008 * std::clamp((t - 1) / 0.4, 0.0, 1.0);
    return {{0, 0, kPegHalfLength_m - 0.015 - down}, turn_about(tilt, Vector::UnitY())};
  };
  path.duration_s = 1.5;
  path.retreat_w = {0, 0, 0.03};
  path.approach_s = 1;
  const Trace trace = run_trace(scene, LawId::kProxy, path);
  const auto pushed = trace.path().subspan(1001);
  double largest_n = 0;
  for (const TraceTick& tick : pushed) largest_n = std::max(largest_n, tick.force_n.z());
  Figure force{"F against the push (N)", force_n, largest_n, force_n / 2, 2 * force_n};
  if (mu == 0) force.least = -2 * force_n;
  return {force, {"gap (m)", 0, worst_gap_m(trace.ticks), kFree_m, 1}};
}

}  // namespace

std::vector<CaseRow> limit_rows() {
  return {{"recovery_3.7", "begins 3.7 mm deep",
           [] { return recovery_figures(flat_at(0.0037), 0.0037, 7); }},
          {"recovery_0.55", "begins 0.55 mm deep",
           [] { return recovery_figures(flat_at(0.00055), 0.00055, 1); }},
          {"recovery_2.7", "begins 2.7 mm deep, corner down",
           [] { return recovery_figures(corner_down_at(0.0027), 0.0027, 4); }},
          {"full_turn", "full turn in a square hole, limit 0.3 rad", full_turn_figures},
          {"deep_push", "60 mm push, limit 8 mm", deep_push_figures},
          {"teleport", "jump of 100 mm and 2.5 rad", teleport_figures},
          {"behind_plate", "jump to behind a plate", behind_plate_figures}};
}

std::vector<CaseRow> friction_rows() {
  return {
      {"drag_0.1", "box dragged, mu 0.1", [] { return drag_figures(0.1); }},
      {"drag_0.3", "box dragged, mu 0.3", [] { return drag_figures(0.3); }},
      {"drag_0.6", "box dragged, mu 0.6", [] { return drag_figures(0.6); }},
      {"circle_0.3", "sliding circle, mu 0.3", [] { return circle_figures(0.3); }},
      {"circle_0", "sliding circle, mu 0", [] { return circle_figures(0); }},
      {"spin_0.4", "spun at 0.5 rad/s, tremor 0.1 um, mu 0.4", [] { return spin_figures(0.4); }},
      {"directions_0.4", "dragged in 360 directions, mu 0.4",
       [] { return direction_figures(0.4); }},
      {"stick_0.4", "held 60 s with tremor 0.1 um, mu 0.4", [] { return stick_figures(0.4); }},
      {"jam_0", "peg tilted 0.08 rad, pushed 8 mm, mu 0", [] { return jam_figures(0, 0.03); }},
      {"jam_0.2", "the same, mu 0.2", [] { return jam_figures(0.2, 0.91); }},
      {"jam_0.5", "the same, mu 0.5", [] { return jam_figures(0.5, 2.45); }}};
}

}  // namespace haptic::sim
