// SPDX-License-Identifier: Apache-2.0
#include "host_sim/stability/peg_insertion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_sim/commands/core_session.hpp"

namespace haptic::sim {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// 0 before `begin`, 1 after `end`, with no jump of the slope.
double smooth(double t, double begin, double end) {
  const double u = std::clamp((t - begin) / (end - begin), 0.0, 1.0);
  return u * u * (3 - 2 * u);
}

// Times of the paths [s].
constexpr double kWobbleEnd = 4.6, kDown = 3.6, kPressed = 4.4;
constexpr double kTiltBegin = 0.2, kTiltEnd = 1.2, kPushEnd = 2.8, kTiltedEnd = 3.0;
constexpr double kTiltedDepth_m = 0.015;

PathPose wobble(double s) {
  // The lower end goes from 5 mm above the rim to 1 mm below the floor at -40 mm.
  const double tip = 0.005 - 0.046 * smooth(s, 0, kDown);
  const double sway = smooth(s, 1.2, 1.6) * (1 - smooth(s, 3.2, kDown));
  const double aside = smooth(s, kDown, kPressed);
  PathPose pose;
  pose.p = Vector(0.0015 * sway * std::sin(kTurn * 2 * s) + 0.002 * aside,
                  0.0012 * sway * std::sin(kTurn * 1.5 * s), tip + kPegHalfLength_m);
  pose.q = Eigen::AngleAxisd(0.03 * sway * std::sin(kTurn * 1.1 * s),
                             Vector(0.6, 0.8, 0.1).normalized());
  return pose;
}

PathPose tilted(double s) {
  PathPose pose;
  const double push = kPegPush_m * std::clamp((s - kTiltEnd) / (kPushEnd - kTiltEnd), 0.0, 1.0);
  pose.p = Vector(0, 0, kPegHalfLength_m - kTiltedDepth_m - push);
  pose.q = Eigen::AngleAxisd(kPegTilt_rad * smooth(s, kTiltBegin, kTiltEnd), Vector::UnitY());
  return pose;
}

PathPose path_pose_of(const Pose& pose) {
  return {pose.p_wa.cast<double>(), pose.q_wa.cast<double>()};
}

}  // namespace

PathPose device_on(PegPath path, double s) {
  return path == PegPath::kWobble ? wobble(s) : tilted(s);
}

double duration_s(PegPath path) { return path == PegPath::kWobble ? kWobbleEnd : kTiltedEnd; }

std::vector<std::byte> peg_scene(double clearance_m, double friction) {
  tools::SceneDescription scene;
  scene.name = "peg in a hole of five pieces";
  const Solid peg = centred_box("peg", kPegHalfWidth_m, kPegHalfWidth_m, kPegHalfLength_m);
  scene.moving.body = united_body({&peg, 1});
  tools::PlacedBody hole;
  hole.body = united_body(five_piece_hole(kPegHalfWidth_m + clearance_m));
  hole.friction = friction;
  scene.statics.push_back(hole);
  scene.parameters.law = LawId::kProxy;
  scene.parameters.k_f_n_per_m = kPegStiffness_n_per_m;
  scene.parameters.coupling.k_r_nm_per_rad = kPegTurnStiffness_nm_per_rad;
  return tools::write_scene(scene);
}

PegRun run_peg(std::span<const std::byte> scene, PegPath path, double period_s, bool trace) {
  CoreSession session(scene, "peg");
  PegRun run;
  const auto ticks = static_cast<std::uint32_t>(std::lround(duration_s(path) / period_s));
  double push_begin_z = 0, last_begin_z = 0;
  for (std::uint32_t k = 0; k <= ticks; ++k) {
    const double t_s = k * period_s;
    run.device = device_on(path, t_s);
    StepInput input;
    input.sequence = k;
    input.pose_wa = pose_at(run.device.p, run.device.q);
    const StepResult result = session.core().step(input);
    if (result.status != RtStatus::kOk) run.refused_ticks += 1;
    run.proxy = path_pose_of(result.proxy_pose_wa);
    const Vector force = result.wrench_w.force_w.cast<double>();
    const Vector torque = result.wrench_w.torque_w.cast<double>();
    if (k > 0) {
      run.largest_force_step_n = std::max(run.largest_force_step_n, (force - run.force_n).norm());
      run.largest_torque_step_nm =
          std::max(run.largest_torque_step_nm, (torque - run.torque_nm).norm());
    }
    run.force_n = force;
    run.torque_nm = torque;
    run.worst_gap_m = std::min(run.worst_gap_m, static_cast<double>(result.proxy_gap_m));
    const Vector tip = run.proxy.p - run.proxy.q * Vector(0, 0, kPegHalfLength_m);
    run.deepest_tip_m = std::min(run.deepest_tip_m, tip[2]);
    if (t_s <= kTiltEnd) push_begin_z = run.proxy.p[2];
    if (t_s <= kPushEnd - 0.1 * (kPushEnd - kTiltEnd)) last_begin_z = run.proxy.p[2];
    if (!trace) continue;
    run.t_s.push_back(t_s);
    run.lag_mm.push_back(1e3 * (run.proxy.p[2] - run.device.p[2]));
    run.force_z_n.push_back(force[2]);
    run.offset_mm.push_back(1e3 * run.proxy.p[0]);
  }
  run.advance_m = push_begin_z - run.proxy.p[2];
  run.last_advance_m = last_begin_z - run.proxy.p[2];
  return run;
}

double two_point_friction_n(const PegRun& run, double friction) {
  // Lower corner on the side to which the tilt leads, and the rim at z = 0 across from it.
  const double side = run.device.q.y() > run.proxy.q.y() ? -1.0 : 1.0;
  const Vector corner =
      run.proxy.p + run.proxy.q * Vector(side * kPegHalfWidth_m, 0, -kPegHalfLength_m);
  return 2 * friction * std::abs(run.torque_nm[1] / corner[2]);
}

}  // namespace haptic::sim
