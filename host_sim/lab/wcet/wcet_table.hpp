// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The account of a worst-case test for people.

#include <span>
#include <string>

#include "host_sim/lab/wcet/wcet_report.hpp"

namespace haptic::sim {

/// Tables, each under its own heading: counted work and its bounds, wall time of the code, noise of
/// the repeats, wake-ups of the machine, what the search found.
[[nodiscard]] std::string wcet_table(const WcetReport& report, const SceneView& view,
                                     std::span<const MotionSample> motion);

}  // namespace haptic::sim
