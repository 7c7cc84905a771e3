// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Ticks of a closed loop as inputs that a page computes again.

#include "host_sim/device/loop_run.hpp"
#include "tools/live/page_file.hpp"

namespace haptic::sim {

[[nodiscard]] tools::RecordedTick recorded_tick(const LoopRecord& record, double rate_hz);

}  // namespace haptic::sim
