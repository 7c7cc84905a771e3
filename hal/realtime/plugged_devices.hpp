// SPDX-License-Identifier: Apache-2.0
#pragma once
/// USB devices that Linux has found, with what they say of themselves. Opens none of them.

#include <cstdint>
#include <string>
#include <vector>

#include "hal/realtime/system_tree.hpp"

namespace haptic::hal {

struct PluggedDevice {
  std::uint16_t vendor_id = 0, product_id = 0;
  std::string serial, product;  ///< empty where the device has none
  std::string bus_path;         ///< "1-2.3"
  int bus = 0, number = 0;      ///< of its node /dev/bus/usb/BUS/NUMBER
};

/// By bus path; interfaces and hubs' roots are no devices.
[[nodiscard]] std::vector<PluggedDevice> plugged_devices(const SystemTree& tree);

}  // namespace haptic::hal
