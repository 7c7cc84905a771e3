// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Plugs a device behind USB/IP into this machine: a port of the kernel's virtual host controller
/// (vhci-hcd) is given one end of a socket. The device is gone when the other end is closed, for
/// instance because its process has died.

#include <optional>
#include <string>
#include <string_view>

namespace haptic::sim {

/// Where the kernel has the controller.
inline constexpr const char* kVhciFolder = "/sys/devices/platform/vhci_hcd.0";

/// First free high-speed port by the controller's `status` file; nothing when none is free.
[[nodiscard]] std::optional<unsigned> free_vhci_port(std::string_view status);

/// Hands `descriptor`, a stream socket with a UsbipCarrier at its other end, to the kernel and
/// returns the port. The caller keeps its descriptor; the kernel has its own. `speed`: 3 = high,
/// 2 = full. Enumeration goes on after it.
/// @throws std::runtime_error with what to do: no such module, no right to attach, no free port.
unsigned attach_to_vhci(int descriptor, int speed, const std::string& folder = kVhciFolder);

/// Gives the kernel's threads that carry attached devices (vhci_rx, vhci_tx) this SCHED_FIFO
/// priority, so that nothing ordinary delays a report; returns how many took it. Needs root.
unsigned raise_vhci_threads(int priority, const std::string& processes = "/proc");

}  // namespace haptic::sim
