// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Ticks of a closed loop as whoever watches it gets them: inputs that a page computes again, and
/// the state that a live session shows.

#include "host_sim/device/loop_run.hpp"
#include "tools/live/live_state.hpp"
#include "tools/live/page_file.hpp"

namespace haptic::sim {

[[nodiscard]] tools::RecordedTick recorded_tick(const LoopRecord& record, double rate_hz);

/// `hand_stamp`: of the order that the tick followed.
[[nodiscard]] tools::LiveState live_state(const LoopRecord& record, double hand_stamp = 0);

}  // namespace haptic::sim
