// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Records of a flight recorder as ticks of a session: in the axes and at the places of the scene.

#include <cstdint>
#include <span>
#include <vector>

#include "rt_core/exchange/step_trace.hpp"
#include "rt_core/servo_tick.hpp"
#include "tools/library/haptic.h"

namespace haptic::tools {

/// From the device to the scene, for the records of one process that renders.
struct HistoryPlace {
  WorkspaceMap map;              ///< of the configuration
  StartPlace start;              ///< with it the map is found at each tick in which the part begins
  WorkspaceMap begun;            ///< found last
  std::uint64_t began_tick = 0;  ///< at that tick; 0: it has not begun
  std::uint64_t ticks_before = 0;  ///< of processes that have rendered before this one
  std::int64_t opened_ns = 0;
};

/// Appends them, oldest first. The map is found again as the tick has found it. Records from before
/// the first begin that is kept have no map, and are left out.
void append_ticks(std::span<const StepTrace> records, const HistoryPlace& place,
                  std::vector<haptic_tick>& ticks);

}  // namespace haptic::tools
