// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/peg_insertion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_sim/session/core_session.hpp"

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
/// The peg has slipped when it has gone so far.
constexpr double kSlip_m = 2e-4;

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

double lowest_corner_m(const PathPose& peg) {
  double lowest = peg.p[2];
  for (const double x : {-kPegHalf_m, kPegHalf_m}) {
    for (const double y : {-kPegHalf_m, kPegHalf_m})
      lowest = std::min(lowest, (peg.p + peg.q * Vector(x, y, -kPegHalfLength_m))[2]);
  }
  return lowest;
}

}  // namespace

PathPose device_on(PegPath path, double s) {
  return path == PegPath::kWobble ? wobble(s) : tilted(s);
}

double duration_s(PegPath path) { return path == PegPath::kWobble ? kWobbleEnd : kTiltedEnd; }

std::vector<std::byte> inserted_peg_scene(double clearance_m, double friction) {
  tools::SceneDescription scene;
  scene.name = "peg in a hole of five pieces";
  const Solid peg = centred_box("peg", kPegHalf_m, kPegHalf_m, kPegHalfLength_m);
  scene.moving.body = united_body({&peg, 1});
  tools::PlacedBody hole;
  hole.body = united_body(five_piece_hole(kPegHalf_m + clearance_m));
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
  PegState now;
  const auto ticks = static_cast<std::uint32_t>(std::lround(duration_s(path) / period_s));
  double push_begin_z = 0;
  bool slipped = false;
  for (std::uint32_t k = 0; k <= ticks; ++k) {
    const double t_s = k * period_s;
    now.device = device_on(path, t_s);
    StepInput input;
    input.sequence = k;
    input.pose_wa = pose_at(now.device.p, now.device.q);
    const StepResult result = session.core().step(input);
    if (result.status != RtStatus::kOk) run.refused_ticks += 1;
    now.proxy = path_pose_of(result.proxy_pose_wa);
    const Vector force = result.wrench_w.force_w.cast<double>();
    const Vector torque = result.wrench_w.torque_w.cast<double>();
    if (k > 0) {
      run.largest_force_step_n = std::max(run.largest_force_step_n, (force - now.force_n).norm());
      run.largest_torque_step_nm =
          std::max(run.largest_torque_step_nm, (torque - now.torque_nm).norm());
    }
    now.force_n = force;
    now.torque_nm = torque;
    run.largest_force_n = std::max(run.largest_force_n, force.head<2>().norm());
    run.worst_gap_m = std::min(run.worst_gap_m, static_cast<double>(result.proxy_gap_m));
    run.deepest_m = std::min(run.deepest_m, lowest_corner_m(now.proxy));
    if (t_s <= kTiltEnd) push_begin_z = now.proxy.p[2];
    if (!slipped && push_begin_z - now.proxy.p[2] > kSlip_m) {
      slipped = true;
      run.slip = now;
    }
    if (!trace) continue;
    run.t_s.push_back(t_s);
    run.lag_mm.push_back(1e3 * (now.proxy.p[2] - now.device.p[2]));
  }
  run.end = now;
  run.advance_m = push_begin_z - now.proxy.p[2];
  return run;
}

double reach_aside_m(const PathPose& peg) {
  double reach = -kPegHalfLength_m;
  for (const double y : {-kPegHalf_m, kPegHalf_m}) {
    for (const double x : {-kPegHalf_m, kPegHalf_m}) {
      const Vector low = peg.p + peg.q * Vector(x, y, -kPegHalfLength_m);
      Vector high = peg.p + peg.q * Vector(x, y, kPegHalfLength_m);
      if (low[2] > 0) continue;
      if (high[2] > 0) high = low + (high - low) * (low[2] / (low[2] - high[2]));  // at the rim
      reach = std::max({reach, low[0], high[0]});
    }
  }
  return reach - kPegHalf_m;
}

double two_point_force_n(const PegState& state, double clearance_m, double friction) {
  const auto moment = [](const Vector& arm, const Vector& f) { return arm.cross(f)[1]; };
  const Vector axis = state.proxy.q * Vector::UnitZ();
  const double side = axis[0] > 0 ? -1.0 : 1.0;  // the lower end leans to this side
  const Vector corner =
      state.proxy.p + state.proxy.q * Vector(side * kPegHalf_m, 0, -kPegHalfLength_m);
  const Vector rim(-side * (kPegHalf_m + clearance_m), 0, 0);
  const Vector at_corner = Vector(-side, 0, 0) + friction * Vector::UnitZ();
  const Vector at_rim = side * (state.proxy.q * Vector::UnitX()) + friction * axis;
  // The spring pulls the peg with the opposite of what the hand feels. Moments about the corner,
  // then forces along x.
  const Vector pull = -state.force_n;
  const double spring = moment(state.proxy.p - corner, Vector(pull[0], 0, 0)) - state.torque_nm[1];
  // The pull along z is what is sought: it is the sum of both contacts.
  const double lever = (state.proxy.p - corner)[0];
  const double rim_moment = moment(rim - corner, at_rim);
  // N_c = -(pull_x + N_r at_rim_x) / at_corner_x; F_z = N_c mu + N_r at_rim_z = -pull_z;
  // 0 = spring + lever F_z + N_r rim_moment.
  const double corner_x = at_corner[0];
  const double force_0 = -friction * pull[0] / corner_x;
  const double force_1 = at_rim[2] - friction * at_rim[0] / corner_x;
  const double n_rim = std::max(0.0, -(spring + lever * force_0) / (rim_moment + lever * force_1));
  return force_0 + force_1 * n_rim;
}

}  // namespace haptic::sim
