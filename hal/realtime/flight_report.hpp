// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The last ticks of a flight recorder for people and for tables: what a servo process did before
/// it died. Not for the loop: allocates.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "rt_core/exchange/step_trace.hpp"

namespace haptic::hal {

/// All texts of a set of SafetyFault bits, joined by "; "; "" where none is set.
[[nodiscard]] std::string safety_fault_texts(std::uint32_t faults);

/// The same of DeviceFault.
[[nodiscard]] std::string device_fault_texts(std::uint32_t faults);

/// A heading, and a line for each of the last `most_ticks` of `records` (oldest first): time to the
/// last tick [ms], age of the state that it rests on [ms], state of link and arming, handle [mm],
/// distance to the nearest C-face [mm], norms of rendered and commanded force [N] and torque [N m].
/// Faults and ticks that are missing stand on lines of their own where they change. Numbers that
/// were no numbers are shown as they are.
[[nodiscard]] std::string flight_text(std::span<const StepTrace> records, std::size_t most_ticks);

/// Every field of every record, a header line first; LF. Numbers read back as they were.
[[nodiscard]] std::string flight_csv(std::span<const StepTrace> records);

}  // namespace haptic::hal
