// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A session of a device, as its flight recorder has it: read from a process of its own, which the
/// servo process does not know of. The recorder holds where the handle was and what was rendered,
/// not all that the core was given, so a page shows the picture and compares nothing.

#include <cstdint>
#include <span>
#include <vector>

#include "rt_core/exchange/device_exchange.hpp"
#include "rt_core/exchange/step_trace.hpp"
#include "rt_core/servo_tick.hpp"
#include "tools/live/live_session.hpp"

namespace haptic::tools {

/// Takes what is new in the flight recorders of a servo process and its spares to a board. Owner:
/// one thread.
class TraceFollower {
 public:
  /// `recorders`: memory of a FlightRecorder each, which outlives this. `map`: with its grip point;
  /// `start`: with which the servo tick finds the rest of the map.
  TraceFollower(std::vector<std::span<const std::byte>> recorders, const WorkspaceMap& map,
                LiveBoard& board, const StartPlace& start = {});

  void look();

 private:
  [[nodiscard]] std::size_t at_work();
  void take(const StepTrace& trace, bool goes_on);

  std::vector<std::span<const std::byte>> recorders_;
  WorkspaceMap map_;
  StartPlace start_;
  LiveWriter writer_;
  std::vector<StepTrace> room_;
  std::size_t process_ = 0;
  StepTrace last_;             ///< tick 0: none yet
  std::int64_t begin_ns_ = 0;  ///< of the first tick
};

/// Serves the session of a device until it is killed; view only. `servo`: of its tick, but for grip
/// point and start pose, which the scene has.
void serve_trace(LiveDoor& door, const SceneView& scene, const ServoParameters& servo,
                 std::vector<std::span<const std::byte>> recorders);

}  // namespace haptic::tools
