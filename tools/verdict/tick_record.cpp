// SPDX-License-Identifier: Apache-2.0
#include "tools/verdict/tick_record.hpp"

#include <cmath>

namespace haptic::tools {
namespace {

void put(const Vec3& from, double (&to)[3]) {
  for (int k = 0; k < 3; ++k) to[k] = static_cast<double>(from[k]);
}

}  // namespace

PoseNumbers::PoseNumbers(const Pose& pose) {
  put(pose.p_wa, p_m);
  for (int k = 0; k < 4; ++k) q_xyzw[k] = static_cast<double>(pose.q_wa.coeffs()[k]);
}

PoseNumbers::operator Pose() const {
  const auto real = [](double x) { return static_cast<Real>(x); };
  return {Vec3(real(p_m[0]), real(p_m[1]), real(p_m[2])),
          Quat(real(q_xyzw[3]), real(q_xyzw[0]), real(q_xyzw[1]), real(q_xyzw[2]))};
}

TickRecord record_of(std::uint64_t tick, double t_s, const StepResult& result, LawId law,
                     const Vec3& grip_a) {
  TickRecord record;
  record.tick = tick;
  record.t_s = t_s;
  put(result.wrench_w.force_w, record.force_n);
  put(result.wrench_w.torque_w, record.torque_nm);
  record.device_wa = record.goal_wa = result.goal_pose_wa;
  record.proxy_wa = result.proxy_pose_wa;
  const auto grip_w = [&](const Pose& pose) -> Vec3 { return pose.p_wa + pose.q_wa * grip_a; };
  const Vec3 goal_grip_w = grip_w(result.goal_pose_wa), proxy_grip_w = grip_w(result.proxy_pose_wa);
  put(goal_grip_w, record.goal_grip_m);
  put(proxy_grip_w, record.proxy_grip_m);
  record.apart_m = static_cast<double>(std::sqrt((goal_grip_w - proxy_grip_w).squaredNorm()));
  record.proxy_gap_m = static_cast<double>(result.proxy_gap_m);
  record.potential_j = static_cast<double>(result.potential_j);
  record.energy_j = static_cast<double>(result.energy_j);
  record.d_near_m = static_cast<double>(result.d_near_m);
  record.state_hash = result.state_hash;
  record.status = result.status;
  record.flags = result.flags;
  record.situation = result.situation;
  record.near_count = result.near_count;
  record.nearest_pair = result.nearest_pair;
  record.has_goal_contact = result.has_goal_contact ? 1 : 0;
  record.behind_ticks = result.behind_ticks;
  record.work_units = result.counters.work_units;
  record.nodes_evaluated = result.counters.feature_evaluations + result.counters.edge_pairs;
  record.support_pairs = result.counters.support_pairs;
  record.relocalised_pairs = result.counters.stale_pairs;
  const JudgedTick judged = judged_tick(result, law);
  record.in_contact = judged.in_contact ? 1 : 0;
  record.pull_n = judged.pull_n;
  if (const Guidance& guide = result.guidance; guide.state != GuideState::kNone) {
    put(guide.wrench_w.force_w, record.guide.force_n);
    put(guide.wrench_w.torque_w, record.guide.torque_nm);
    record.guide.to_go_m = static_cast<double>(guide.cost_m);
    record.guide.off_m = static_cast<double>(guide.off_m);
    record.guide.state = guide.state;
    record.guide.station = guide.station;
  }
  return record;
}

JudgedTick judged_tick(const TickRecord& record) noexcept {
  return {record.status != RtStatus::kOk, record.in_contact != 0, record.pull_n, record.flags,
          record.energy_j};
}

}  // namespace haptic::tools
