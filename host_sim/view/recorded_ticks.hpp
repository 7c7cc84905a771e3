// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Ticks of a motion as a page gets them, which computes them again.

#include <cstdint>
#include <span>
#include <vector>

#include "host_sim/session/core_session.hpp"
#include "host_sim/session/motion_csv.hpp"
#include "tools/live/page_file.hpp"

namespace haptic::sim {

/// The recorded tick of sample number `tick` of a motion, whose core had `state_hash` after it.
[[nodiscard]] tools::RecordedTick recorded_tick(const MotionSample& sample, std::uint64_t tick,
                                                std::uint64_t state_hash);

/// Runs a motion from a forgotten contact history and keeps what the page compares.
[[nodiscard]] std::vector<tools::RecordedTick> record_motion(CoreSession& session,
                                                             std::span<const MotionSample> motion);

}  // namespace haptic::sim
