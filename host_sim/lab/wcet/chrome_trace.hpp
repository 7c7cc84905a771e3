// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A run in the Trace Event Format that Perfetto and chrome://tracing open: one bar per tick.

#include <span>
#include <string>

#include "host_sim/timing/tick_times.hpp"

namespace haptic::sim {

/// A JSON object: two events that name process and thread, then one complete event ("ph": "X") per
/// tick, "ts" the sample's time in the motion and "dur" the tick's least time in the loop, both in
/// us; "args" has number, D_near, situation, flags by name, and the counted work. Sizes agree.
[[nodiscard]] std::string chrome_trace(std::span<const TickTime> ticks,
                                       std::span<const MotionSample> motion,
                                       const std::string& scene);

}  // namespace haptic::sim
