// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The histograms of a worst-case test: time per tick and, apart from it, wake-ups of the machine.

#include <string>

#include "hal/realtime/wakeup_measurement.hpp"
#include "host_sim/timing/same_state_times.hpp"

namespace haptic::sim {

/// An SVG with two panels, counts and times logarithmic, twenty bins per power of ten: above the
/// least times of the ticks, in the loop and with flushed caches, and all repeats as they were;
/// below how late the machine woke a thread.
[[nodiscard]] std::string wcet_plot(const WcetResult& loop, const SameStateTimes& same_state,
                                    const hal::WakeupMeasurement& wakeups,
                                    const std::string& title);

}  // namespace haptic::sim
