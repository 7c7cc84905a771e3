// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/serial_adapters.hpp"

#include <array>

namespace haptic::hal {
namespace {

constexpr std::array kAdapters = {
    SerialAdapter{0x0301, 0x2988, "3D Systems Touch", "openhaptics", false},
    SerialAdapter{0x2988, 0x0302, "3D Systems Touch, later", "openhaptics", false},
    SerialAdapter{0x0403, 0x6014, "ROBOTIS U2D2", "dynamixel", true},
    SerialAdapter{0x1a86, 0x55d3, "servo board of SO-100, SO-101, Waveshare", "feetech", false}};

}  // namespace

std::span<const SerialAdapter> serial_adapters() noexcept { return kAdapters; }

const SerialAdapter* find_serial_adapter(std::uint16_t vendor_id,
                                         std::uint16_t product_id) noexcept {
  for (const SerialAdapter& each : kAdapters) {
    if (each.vendor_id == vendor_id && each.product_id == product_id) return &each;
  }
  return nullptr;
}

}  // namespace haptic::hal
