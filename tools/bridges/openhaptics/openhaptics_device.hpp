// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Bridge to 3D Systems' Touch and Touch X and to the Phantoms, by libHD of OpenHaptics 3.x.
///
/// libHD calls back on a thread of its own, and states no watchdog in time: VendorExchange takes
/// the force away when the bridge stalls, and libHD's own checks (rate, force, velocity) stay on.

#include <memory>

#include "hal/bridge/bridged_device.hpp"
#include "hal/drivers/driver_registry.hpp"

namespace haptic::tools {

/// Keys of `options`: library, device, rate, device_velocity; driver_registry.cpp has their ranges.
/// Null: `defect`.
[[nodiscard]] std::unique_ptr<hal::BridgedDevice> make_openhaptics(
    const hal::DriverOptions& options, hal::DriverDefect& defect);

}  // namespace haptic::tools
