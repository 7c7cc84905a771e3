// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Picture of a run of the device stack: what was rendered, what was handed to the bus and what
/// acted on the handle, with depth, arming and link below.

#include <span>
#include <string>

#include "host_sim/device/stack_run.hpp"

namespace haptic::sim {

/// A complete SVG document; size and reduction as replay_plot. `title` may hold any text.
/// Deterministic.
[[nodiscard]] std::string stack_plot(std::span<const StackRecord> records,
                                     const std::string& title);

}  // namespace haptic::sim
