// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Serves a bridged device to a host: the device's side of the reference protocol behind a
/// DevicePort, with the state machine that firmware has (hal/firmware/reference_device.h).

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

#include "hal/bridge/bridged_device.hpp"

namespace haptic::hal {

struct BridgeSettings {
  std::string path;                        ///< of the socket to listen at
  std::int64_t period_ns = 1'000'000;      ///< at least the device's own
  /// Without an accepted command for this long the force goes off.
  std::int64_t watchdog_ns = 20'000'000;
  std::int64_t again_ns = 1'000'000'000;   ///< between two tries to open the device
  std::function<void(const std::string&)> say;  ///< a line for people; never while force is on
};

/// Runs until `stop` is set, which a signal handler may do; then takes the force away.
/// @return 0, or an errno of listening.
[[nodiscard]] int serve_bridge(BridgedDevice& device, const BridgeSettings& settings,
                               const std::atomic<bool>& stop);

}  // namespace haptic::hal
