// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A bridged device in the units of the reference protocol.

#include "hal/bridge/bridged_device.hpp"
#include "hal/firmware/reference_device.h"

namespace haptic::hal {

/// Statement of a device about itself as the protocol has it: numbers beyond its ranges become the
/// nearest that it has, the period at least 100 us and at most 20 ms. A driven degree of freedom
/// without a largest force is not driven, nor is one behind a displacement. A text
/// that is none is not stated.
[[nodiscard]] haptic_facts facts_of(const DeviceCapabilities& capabilities,
                                    std::int64_t watchdog_ns) noexcept;

/// False: a number is not finite, the orientation is none, or a position is beyond 2 m; `out` is
/// unchanged then. A twist that is not finite counts as not sensed.
[[nodiscard]] bool sample_of(const BridgeSample& sample, haptic_sample& out) noexcept;

[[nodiscard]] Wrench wrench_of(const haptic_drive& drive) noexcept;

}  // namespace haptic::hal
