// SPDX-License-Identifier: Apache-2.0
#include "host_sim/view/loop_ticks.hpp"

#include <algorithm>

namespace haptic::sim {
namespace {

void put(const Pose& pose, double (&p)[3], double (&q)[4]) {
  for (int k = 0; k < 3; ++k) p[k] = static_cast<double>(pose.p_wa[k]);
  for (int k = 0; k < 4; ++k) q[k] = static_cast<double>(pose.q_wa.coeffs()[k]);
}

}  // namespace

tools::RecordedTick recorded_tick(const LoopRecord& record, double rate_hz) {
  StepInput input;
  input.stamp_ns = loop_stamp_ns(record.tick.tick, rate_hz);
  input.pose_wa = record.tick.device_wa;
  input.accepted_wrench_w = record.accepted_w;
  input.accepted_valid = true;
  tools::RecordedTick recorded = tools::recorded_tick(input, record.tick.state_hash);
  if (record.tick.tick == 0) recorded.marks |= tools::kMarkReset;
  return recorded;
}

tools::LiveState live_state(const LoopRecord& record, double hand_stamp) {
  const TickRecord& tick = record.tick;
  tools::LiveState state;
  state.tick = tick.tick;
  state.t_s = tick.t_s;
  put(record.tick.device_wa, state.device_p_m, state.device_q_xyzw);
  put(record.tick.proxy_wa, state.felt_p_m, state.felt_q_xyzw);
  std::copy_n(tick.force_n, 3, state.force_n);
  std::copy_n(tick.torque_nm, 3, state.torque_nm);
  state.apart_m = tick.apart_m;
  state.gap_m = tick.proxy_gap_m;
  state.d_near_m = tick.d_near_m;
  state.energy_j = tick.energy_j;
  state.state_hash = tick.state_hash;
  state.hand_stamp = hand_stamp;
  state.situation = static_cast<std::uint32_t>(tick.situation);
  state.flags = tick.flags;
  state.status = static_cast<std::uint32_t>(tick.status);
  state.work = tick.nodes_evaluated;
  std::copy_n(tick.guide.force_n, 3, state.guide_force_n);
  std::copy_n(tick.guide.torque_nm, 3, state.guide_torque_nm);
  state.guide_to_go_m = tick.guide.to_go_m;
  state.guide_off_m = tick.guide.off_m;
  state.guide_state = static_cast<std::uint32_t>(tick.guide.state);
  state.guide_station = tick.guide.station;
  return state;
}

}  // namespace haptic::sim
