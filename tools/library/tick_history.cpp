// SPDX-License-Identifier: Apache-2.0
#include "tools/library/tick_history.hpp"

#include <algorithm>

#include "tools/library/call.hpp"

namespace haptic::tools {
namespace {

Pose handle_in(const StepTrace& trace) noexcept {
  double pose[7];
  std::copy_n(trace.pose_p_m, 3, pose);
  std::copy_n(trace.pose_q_xyzw, 4, pose + 3);
  return pose_of_numbers(pose);
}

Wrench command_in(const StepTrace& trace) noexcept {
  WrenchRecord sent;
  for (int i = 0; i < 3; ++i) {
    sent.force_n[i] = static_cast<Real>(trace.command_force_n[i]);
    sent.torque_nm[i] = static_cast<Real>(trace.command_torque_nm[i]);
  }
  return wrench_of(sent);
}

}  // namespace

void append_ticks(std::span<const StepTrace> records, const HistoryPlace& place,
                  std::vector<haptic_tick>& ticks) {
  WorkspaceMap map = place.map;
  bool has_map = !place.start.place && !place.start.turn;
  for (const StepTrace& from : records) {
    const Pose sensed_dh = handle_in(from);
    const Vec3 arm_d = handle_arm(map, sensed_dh.q_wa);
    if (from.began != 0) {
      map = begun_map(place.map, place.start, at_handle_point(sensed_dh, arm_d));
      has_map = true;
    } else if (!has_map && place.began_tick != 0 && from.tick >= place.began_tick) {
      map = place.begun;
      has_map = true;
    }
    if (!has_map) continue;
    haptic_tick to{};
    to.tick = place.ticks_before + from.tick;
    to.time_s = 1e-9 * static_cast<double>(from.now_ns - place.opened_ns);
    write_numbers(mesh_pose(map, at_handle_point(sensed_dh, arm_d)), to.hand_pose);
    std::copy_n(from.rendered_force_n, 3, to.wrench);
    std::copy_n(from.rendered_torque_nm, 3, to.wrench + 3);
    write_numbers(scene_wrench(map, about_handle_point(command_in(from), arm_d)), to.sent_wrench);
    to.situation = std::min<std::uint32_t>(from.situation, 6);
    to.flags = from.step_flags;
    to.arming = std::min<std::uint32_t>(from.arming, 4);
    to.safety_faults = from.faults;
    ticks.push_back(to);
  }
}

}  // namespace haptic::tools
