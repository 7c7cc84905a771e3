// SPDX-License-Identifier: Apache-2.0
// Goal and proxy of a tick: clutch and anchor, the proxy's memory and its wrench.
#include <algorithm>
#include <cmath>

#include "rt_core/base/rotation.hpp"
#include "rt_core/core_state.hpp"

namespace haptic {
namespace {

/// The goal counts as hooked when it is this many radii of the part away from the proxy.
constexpr Real kHookedShare = 1.0_r;

}  // namespace

void HapticCore::State::place_proxy(Arena& arena, const SceneView& view) noexcept {
  proxy.place(arena, view);
}

/// Pairs and lengths of the proxy from the scene.
void HapticCore::State::configure_proxy() noexcept {
  const SceneParameters& p = scene.parameters();
  const CouplingParameters& c = p.coupling;
  Real radius = 0;
  Real extent = static_cast<Real>(std::sqrt(p.start_p_wa_m[0] * p.start_p_wa_m[0] +
                                            p.start_p_wa_m[1] * p.start_p_wa_m[1] +
                                            p.start_p_wa_m[2] * p.start_p_wa_m[2]));
  for (std::uint32_t i = 0; i < pairs.size(); ++i) {
    const PairView& view = pairs[i].view;
    const BodyRecord& body = scene.bodies()[gates[i].body_b];
    ProxyPair& pair = proxy.pairs()[i];
    pair.view = &view;
    pair.reference_w = bodies[gates[i].body_b].reference_w;
    pair.reach_a_m = static_cast<Real>(view.a.record->reach_m);
    pair.friction = static_cast<Real>(body.friction);
    radius = std::max(radius, pair.reach_a_m);
    extent = std::max(extent, std::sqrt(pair.reference_w.squaredNorm()) +
                                  static_cast<Real>(view.b.record->reach_m));
  }
  spring.k_t_n_per_m = static_cast<Real>(c.k_t_n_per_m);
  spring.k_r_nm_per_rad = static_cast<Real>(c.k_r_nm_per_rad);
  spring.length_m = std::sqrt(spring.k_r_nm_per_rad / spring.k_t_n_per_m);
  anchor.max_rotation_rad = static_cast<Real>(c.max_rotation_error_rad);
  anchor.max_translation_m = static_cast<Real>(c.max_translation_error_m);
  Proxy::Parameters parameters;
  parameters.spring = spring;
  parameters.scale = proxy_scale(radius, extent, static_cast<Real>(c.tolerance_m));
  parameters.passes = c.passes;
  parameters.radius_m = radius;
  proxy_radius_m = radius;
  parameters.epsilon_m = epsilon_m;
  parameters.envelope = envelope;
  parameters.never_turns = is_fixed();
  anchor.never_turns = is_fixed();
  proxy.configure(parameters);
}

GripPose HapticCore::State::device_grip(const Pose& pose_wa) const noexcept {
  GripPose device;
  if (is_fixed()) {
    device.q_wa = envelope.q_wa;
    device.r_wa = fixed_r_wa;
  } else {
    device.q_wa = pose_wa.q_wa.normalized();
    device.r_wa = device.q_wa.toRotationMatrix();
  }
  device.x0_w = pose_wa.p_wa + device.r_wa * grip_a;
  return device;
}

Pose HapticCore::State::mesh_pose(const GripPose& grip) const noexcept {
  return {grip.x0_w - grip.r_wa * grip_a, grip.q_wa};
}

/// From now on the goal stands to the device as these two do.
void HapticCore::State::set_offset(const GripPose& device, const GripPose& goal) noexcept {
  offset.translation_m = goal.x0_w - device.x0_w;
  if (!is_fixed()) offset.rotation = (goal.q_wa * device.q_wa.conjugate()).normalized();
  offset.is_zero = false;
}

/// Where the device asks the part to be: the device's pose with the offsets of clutch and anchor.
/// While clutched the goal stays; on release it goes on from where it is.
GripPose HapticCore::State::goal_of(const GripPose& device, bool clutched,
                                    StepResult& result) noexcept {
  GripPose goal = device;
  if (offset.clutched) {
    if (clutched) {
      result.flags |= kFlagClutched;
      return frozen_goal;
    }
    offset.clutched = false;
    set_offset(device, frozen_goal);
  }
  if (!offset.is_zero) {
    goal.x0_w += offset.translation_m;
    if (!is_fixed()) {
      goal.q_wa = (offset.rotation * device.q_wa).normalized();
      goal.r_wa = goal.q_wa.toRotationMatrix();
    }
  }
  PoseError error;
  if (has_law(LawId::kProxy) && proxy.started() && limit_goal(anchor, proxy.pose(), goal, error)) {
    set_offset(device, goal);
    result.flags |= kFlagAnchorMoved;
  }
  if (clutched) {
    offset.clutched = true;
    frozen_goal = goal;
    result.flags |= kFlagClutched;
  }
  return goal;
}

/// Watches the goal against the scene's envelope. Of law kProxy the goal is then held inside; the
/// others measure at the pose itself, whatever the marks leave of it. True: the goal was changed.
bool HapticCore::State::keep_inside(GripPose& goal, StepResult& result) noexcept {
  const bool place = kSceneTraits.workspace_limits && envelope.limits_place();
  const bool turn = kSceneTraits.orientation_limits && envelope.limits_turn();
  if (!place && !turn) return false;
  const bool place_alone = is_fixed() || !kSceneTraits.orientation_limits;
  result.outside = place_alone ? watch.update_place(envelope, goal.x0_w)
                               : watch.update(envelope, goal.x0_w, goal.q_wa);
  left = left || result.outside != 0;
  if (left) result.flags |= kFlagOutsideEnvelope;
  if (!has_law(LawId::kProxy)) return false;
  return place_alone ? hold_place(envelope, goal) : hold_inside(envelope, goal);
}

Wrench HapticCore::State::proxy_wrench(const GripPose& goal, std::int64_t stamp_ns,
                                       StepResult& result) noexcept {
  const ProxyTick done = proxy.tick(goal, scratch, near);
  StepCounters& counters = result.counters;
  counters.proxy_passes = done.passes;
  counters.proxy_rejected = done.rejected;
  counters.proxy_rounds = done.rounds;
  counters.proxy_rows = done.rows;
  counters.qp_iterations = done.qp_iterations;
  counters.plane_gaps = done.plane_gaps;
  counters.valid_nodes = done.valid_nodes;
  counters.full_searches = done.full_searches;
  counters.search_work = done.search_work;
  counters.qp_programs = done.qp_programs;
  counters.qp_steps = done.qp_steps;
  if (done.limited) result.flags |= kFlagProxyLimited;
  if (done.recovering) result.flags |= kFlagRecovery;
  result.proxy_pose_wa = mesh_pose(proxy.pose());
  result.proxy_gap_m = done.gap_m;
  result.situation = proxy.felt().situation;
  result.near_count = proxy.felt().point_count;
  result.potential_j = done.end_potential_j;
  result.allowed_rise_j = done.allowed_rise_j;
  if (done.passes == done.rejected) result.flags |= kFlagProxyStuck;
  const Real hooked = kHookedShare * proxy_radius_m;
  if (done.error.translation_m.squaredNorm() > hooked * hooked) result.flags |= kFlagHooked;
  Wrench wrench = spring_wrench(spring, done.error);
  result.spring_w = wrench;
  if (kSceneTraits.coupling_damping && output.damping_ns_per_m > 0)
    damp(done.error, stamp_ns, wrench);
  return wrench;
}

}  // namespace haptic
