// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the wire of a run may show after a fault of a process.

#include "host_sim/lab/processes/process_matrix.hpp"

namespace haptic::sim {

/// Force of the device that is run, and of the one that replaces it. Half of it or less is what a
/// machine that wakes threads late leaves: still a ramp of several periods.
inline constexpr double kProcessDevice_n = 24, kOtherProcessDevice_n = 0.2;
/// Forces of the wire are whole units of the device.
inline constexpr double kWireRounding_n = 0.01;
/// How long a run is watched after its fault.
inline constexpr std::int64_t kProcessWatch_ns = 600'000'000;

/// Verdict on what the wire of a run says; `slew_n_per_s` of the device. Adds to its failures.
void judge_wire(ProcessVerdict& verdict, double slew_n_per_s);

}  // namespace haptic::sim
