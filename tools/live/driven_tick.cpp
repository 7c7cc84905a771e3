// SPDX-License-Identifier: Apache-2.0
#include "tools/live/driven_tick.hpp"

#include "rt_core/base/rotation.hpp"

namespace haptic::tools {

namespace {

void set_push(const Wrench& pushed_w, DrivenTick& tick) {
  for (int k = 0; k < 3; ++k) {
    tick.push_n[k] = static_cast<double>(pushed_w.force_w[k]);
    tick.push_nm[k] = static_cast<double>(pushed_w.torque_w[k]);
  }
}

}  // namespace

DrivenTick driven_tick(const DrivenState& state) {
  DrivenTick tick;
  tick.commanded_wa = state.commanded_wa;
  tick.felt_wa = state.felt_wa;
  tick.lag_m = static_cast<double>(state.lag_m);
  tick.lag_rad = static_cast<double>(state.lag_rad);
  set_push(state.pushed_w, tick);
  return tick;
}

DrivenTick driven_tick(const StepResult& result) {
  DrivenTick tick;
  const Pose &goal = result.goal_pose_wa, &felt = result.proxy_pose_wa;
  tick.commanded_wa = goal;
  tick.felt_wa = felt;
  tick.lag_m = static_cast<double>(robust_length(goal.p_wa - felt.p_wa));
  tick.lag_rad =
      static_cast<double>(robust_length(so3_log((goal.q_wa * felt.q_wa.conjugate()).normalized())));
  set_push(result.wrench_w, tick);
  return tick;
}

}  // namespace haptic::tools
