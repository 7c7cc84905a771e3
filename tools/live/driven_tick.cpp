// SPDX-License-Identifier: Apache-2.0
#include "tools/live/driven_tick.hpp"

namespace haptic::tools {

DrivenTick driven_tick(const DrivenState& state) {
  DrivenTick tick;
  tick.commanded_wa = state.commanded_wa;
  tick.felt_wa = state.felt_wa;
  tick.lag_m = static_cast<double>(state.lag_m);
  tick.lag_rad = static_cast<double>(state.lag_rad);
  for (int k = 0; k < 3; ++k) {
    tick.push_n[k] = static_cast<double>(state.pushed_w.force_w[k]);
    tick.push_nm[k] = static_cast<double>(state.pushed_w.torque_w[k]);
  }
  return tick;
}

}  // namespace haptic::tools
