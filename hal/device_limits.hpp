// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Safety limits that follow from what a device is.

#include <cstdint>

#include "hal/device.hpp"
#include "rt_core/safety/safety_limits.hpp"

namespace haptic::hal {

/// Largest share of its force that a device without a watchdog of its own is given: if the host
/// dies, the last force stays on.
inline constexpr Real kShareWithoutWatchdog = 0.5_r;

/// A ramp to zero is over before an orderly end closes the device (0.3 s) [s].
inline constexpr Real kLongestRamp_s = 0.25_r;

/// Safety limits of a device: its own where known (finite and above zero), else the defaults of
/// SafetyLimits. Two rules join them:
/// - A ramp from full force or torque ends within half the device's watchdog. Where the device's
///   own rate is too slow for that, its force is lowered; where its rate is not known, the slew
///   limit is raised.
/// - A device without a watchdog gets `kShareWithoutWatchdog` of its force and torque, norms and
///   axes alike.
/// `period_ns` is that of the servo loop; not above zero: the default. Cost: constant.
[[nodiscard]] SafetyLimits limits_of(const DeviceCapabilities& capabilities,
                                     std::int64_t period_ns) noexcept;

/// Limits of a connection: of `own` (driver and configuration) and of what the device says of
/// itself now, the tighter of each. Force and torque are lowered where the tighter slew would not
/// end their ramp within half the watchdog and within kLongestRamp_s.
/// @param share  of the stated force and torque that this machine may exert, 0 to 1; `own` is
///               lowered by it already.
[[nodiscard]] SafetyLimits limits_of_connection(const SafetyLimits& own,
                                                const DeviceCapabilities& stated,
                                                Real share = 1) noexcept;

/// The same for the servo thread.
[[nodiscard]] LimitsRecord limits_record(const SafetyLimits& limits,
                                         const DeviceCapabilities& stated,
                                         std::uint32_t connection) noexcept;

}  // namespace haptic::hal
