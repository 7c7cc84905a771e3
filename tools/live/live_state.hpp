// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A tick as whoever watches a session is told of it.

#include <cstdint>

namespace haptic::tools {

/// The newest tick in the words of the core that ran it, as the page gets it.
struct LiveState {
  std::uint64_t tick = 0;  ///< 0, 1, ... since the program began
  double t_s = 0;
  double device_p_m[3] = {}, device_q_xyzw[4] = {0, 0, 0, 1};  ///< A's mesh frame in W
  double felt_p_m[3] = {}, felt_q_xyzw[4] = {0, 0, 0, 1};      ///< the device's where not known
  double force_n[3] = {}, torque_nm[3] = {};
  double apart_m = 0, gap_m = 0, d_near_m = 0, energy_j = 0;
  std::uint64_t state_hash = 0;
  double hand_stamp = 0;  ///< of the hand's order that this tick followed
  std::uint32_t situation = 0, flags = 0, status = 0, work = 0;
  std::uint32_t is_over = 0;  ///< no further tick comes
  std::uint32_t knows_felt = 1;
  double guide_force_n[3] = {}, guide_torque_nm[3] = {};
  double guide_to_go_m = 0, guide_off_m = 0;
  std::uint32_t guide_state = 0, guide_station = 0;  ///< GuideState
};
static_assert(sizeof(LiveState) == 320);

}  // namespace haptic::tools
