// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A hand for a device that runs for as long as somebody wants it: its way, over and over, and the
/// thumb on the deadman switch.

#include <functional>
#include <vector>

#include "host_sim/device/reference_model.hpp"
#include "host_sim/session/motion_csv.hpp"
#include "rt_core/base/workspace_map.hpp"

namespace haptic::sim {

/// Deadman switch of SwitchMap's default.
inline constexpr std::uint32_t kDeadmanBit = 1u << 0;
/// Time for which the thumb lets go of it: long enough for every ramp out.
inline constexpr double kLetGo_s = 0.1;

/// The handle follows `motion`, poses of the part's mesh frame at `rate_hz`, through the inverse of
/// `map`; starts again where it ends where it began, else stays at its end. The deadman is let go
/// for kLetGo_s at 0, `regrip_s`, 2 `regrip_s`, ...: an operator that arms again after anything.
/// `motion` must not be empty; `regrip_s` > kLetGo_s.
[[nodiscard]] std::function<HandAction(double t_s)> hand_routine(std::vector<MotionSample> motion,
                                                                 double rate_hz,
                                                                 const WorkspaceMap& map,
                                                                 double regrip_s);

}  // namespace haptic::sim
