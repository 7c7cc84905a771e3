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
  std::string path;  ///< of the socket to listen at
  /// Without an accepted command for this long the force goes off.
  std::int64_t watchdog_ns = 20'000'000;
  std::int64_t again_ns = 500'000'000;  ///< between two tries to open the device
  /// A line for people: why the device is not there, and that it has come. Once each.
  std::function<void(const std::string& line)> say;
  /// Once, after the device was open for the first time; an errno is said.
  std::function<int()> confine;
};

/// Runs until `stop`, which a signal handler may set; then takes the force away, closes the device
/// and returns. A host finds the socket only while the device is open, and is sent away when the
/// device is lost: to the host it is unplugged. Force is off without a host, after the watchdog's
/// time without an accepted command, while the device cannot be handed its force (after
/// kMostMissedPeriods), and whenever the protocol says so. A command is accepted only by a device
/// that has taken the one before it, and no report comes while the device has a force that was
/// taken away: the host never believes that there is less force than there is.
/// @return 0, or an errno of listening.
[[nodiscard]] int serve_bridge(BridgedDevice& device, const BridgeSettings& settings,
                               const std::atomic<bool>& stop);

/// Periods in a row in which the force could not be handed over, after which the drives are off.
inline constexpr unsigned kMostMissedPeriods = 5;

}  // namespace haptic::hal
