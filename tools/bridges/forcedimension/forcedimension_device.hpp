// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Bridge to Force Dimension's devices (omega, delta, sigma, lambda) and others that libdhd serves.
///
/// Two watchdogs take the force away from a hand that nobody computes for: the device's own, which
/// is set to kDhdWatchdog_ns and read back, and the one between the two threads (VendorExchange).

#include <cstdint>
#include <memory>

#include "hal/bridge/bridged_device.hpp"
#include "hal/drivers/driver_registry.hpp"

namespace haptic::tools {

/// Watchdog of the device, in its units of 125 us. A device that does not keep it is refused.
inline constexpr std::int64_t kDhdWatchdogUnit_ns = 125'000;
inline constexpr std::int64_t kDhdWatchdog_ns = 20'000'000;

/// Keys of `options`: library, serial or index, rate, gripper_closed, device_velocity,
/// no_gravity_compensation; driver_registry.cpp has their ranges. Null: `defect`.
[[nodiscard]] std::unique_ptr<hal::BridgedDevice> make_forcedimension(
    const hal::DriverOptions& options, hal::DriverDefect& defect);

}  // namespace haptic::tools
