// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Picture of a replay over time: force, torque, distance of the part from the device's pose,
/// d_near and contact situation; sudden releases are marked.

#include <span>
#include <string>

#include "host_sim/session/tick_record.hpp"

namespace haptic::sim {

/// A complete SVG document. Curves are reduced to their least and largest value per pixel column,
/// so no peak is lost and the size stays below 1 MB for any number of ticks. `title` may hold any
/// text. Deterministic.
[[nodiscard]] std::string replay_plot(std::span<const TickRecord> ticks, const std::string& title);

}  // namespace haptic::sim
