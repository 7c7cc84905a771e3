// SPDX-License-Identifier: Apache-2.0
#include "host_sim/shapes/proxy_trace.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "host_sim/session/core_session.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

Vector turn_between(const Rotation& from, const Rotation& to) {
  const Eigen::AngleAxisd turn(to * from.conjugate());
  const double angle = turn.angle();
  constexpr double kPi = std::numbers::pi;
  return (angle > kPi ? angle - 2 * kPi : angle) * turn.axis();
}

TraceTick tick_of(const PathPose& device, const StepResult& result) {
  TraceTick tick;
  tick.device = device;
  tick.proxy.p = result.proxy_pose_wa.p_wa.cast<double>();
  tick.proxy.q = result.proxy_pose_wa.q_wa.cast<double>();
  tick.force_n = result.wrench_w.force_w.cast<double>();
  tick.torque_nm = result.wrench_w.torque_w.cast<double>();
  tick.gap_m = static_cast<double>(result.proxy_gap_m);
  tick.potential_j = static_cast<double>(result.potential_j);
  tick.flags = result.flags;
  tick.counters = result.counters;
  return tick;
}

}  // namespace

std::vector<std::byte> compiled(const CoupledScene& scene, LawId law) {
  tools::SceneDescription description;
  description.name = scene.moving.name + " on " + scene.statics.front().name;
  description.moving.body = scene.moving;
  for (const tools::Body& body : scene.statics) {
    tools::PlacedBody placed;
    placed.body = body;
    placed.friction = scene.friction;
    description.statics.push_back(placed);
  }
  SceneParameters& p = description.parameters;
  p.law = law;
  p.k_f_n_per_m = scene.k_t_n_per_m;
  p.epsilon_m = scene.epsilon_m;
  p.coupling.k_t_n_per_m = scene.k_t_n_per_m;
  p.coupling.k_r_nm_per_rad = scene.k_r_nm_per_rad;
  p.coupling.max_rotation_error_rad = scene.max_rotation_rad;
  p.coupling.max_translation_error_m = scene.max_translation_m;
  p.coupling.passes = scene.passes;
  p.coupling.tolerance_m = scene.tolerance_m;
  return tools::write_scene(description);
}

Trace run_trace(const CoupledScene& scene, LawId law, const TimedPath& path, double period_s) {
  const std::vector<std::byte> bytes = compiled(scene, law);
  CoreSession session(bytes, scene.moving.name);
  const auto approach = static_cast<std::size_t>(std::lround(path.approach_s / period_s));
  const auto count = static_cast<std::size_t>(std::lround(path.duration_s / period_s));
  const PathPose first = path.pose(0);
  Trace trace;
  trace.begin = approach;
  trace.ticks.reserve(approach + count + 1);
  for (std::size_t k = 0; k <= approach + count; ++k) {
    PathPose device = first;
    if (k < approach) {
      device.p += (1 - static_cast<double>(k) / static_cast<double>(approach)) * path.retreat_w;
    } else {
      device = path.pose(static_cast<double>(k - approach) * period_s);
    }
    StepInput input;
    input.sequence = k;
    input.stamp_ns = std::llround(static_cast<double>(k) * period_s * 1e9);
    input.pose_wa = pose_at(device.p, device.q);
    const StepResult result = session.core().step(input);
    if (result.status != RtStatus::kOk)
      throw tools::InputError(scene.moving.name + ": a pose is refused: " + to_text(result.status));
    trace.ticks.push_back(tick_of(device, result));
  }
  return trace;
}

WrenchSteps largest_steps(std::span<const TraceTick> ticks) {
  WrenchSteps largest;
  for (std::size_t k = 1; k < ticks.size(); ++k) {
    largest.force_n = std::max(largest.force_n, (ticks[k].force_n - ticks[k - 1].force_n).norm());
    largest.torque_nm =
        std::max(largest.torque_nm, (ticks[k].torque_nm - ticks[k - 1].torque_nm).norm());
  }
  return largest;
}

std::size_t first_jump(std::span<const TraceTick> ticks, double force_n, double torque_nm) {
  for (std::size_t k = 1; k < ticks.size(); ++k) {
    if ((ticks[k].force_n - ticks[k - 1].force_n).norm() > force_n ||
        (ticks[k].torque_nm - ticks[k - 1].torque_nm).norm() > torque_nm) {
      return k;
    }
  }
  return ticks.size();
}

double hand_work_j(std::span<const TraceTick> ticks) {
  double work_j = 0;
  for (std::size_t k = 1; k < ticks.size(); ++k) {
    const TraceTick &a = ticks[k - 1], &b = ticks[k];
    // The wrench acts on the hand, so the hand's own is its opposite.
    work_j -= (a.force_n + b.force_n).dot(b.device.p - a.device.p) / 2;
    work_j -= (a.torque_nm + b.torque_nm).dot(turn_between(a.device.q, b.device.q)) / 2;
  }
  return work_j;
}

double worst_gap_m(std::span<const TraceTick> ticks) {
  double worst = std::numeric_limits<double>::max();
  for (const TraceTick& tick : ticks) worst = std::min(worst, tick.gap_m);
  return worst;
}

double force_ripple_n(std::span<const TraceTick> ticks) {
  double largest = 0;
  for (const TraceTick& tick : ticks)
    largest = std::max(largest, (tick.force_n - ticks.front().force_n).norm());
  return largest;
}

}  // namespace haptic::sim
