// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The blocking side of a bus that a driver uses before reports flow: firmware, line settings,
/// homing. Implemented over libusb, and by the simulated devices in tests.

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/device.hpp"

namespace haptic::hal {

struct ControlRequest {
  std::uint8_t request_type = 0, request = 0;
  std::uint16_t value = 0, index = 0;
};

/// Owner: the USB thread, during Driver::start alone. Every call returns within `timeout_ms`.
class UsbPort {
 public:
  virtual ~UsbPort() = default;
  /// `bytes` is sent or filled, by the direction bit of request_type; `moved` of them were.
  virtual HalStatus control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                            std::size_t& moved, unsigned timeout_ms) noexcept = 0;
  /// To the OUT endpoint of the driver's profile.
  virtual HalStatus write(std::span<const std::uint8_t> bytes, unsigned timeout_ms) noexcept = 0;
  /// One packet from its IN endpoint.
  virtual HalStatus read(std::span<std::uint8_t> bytes, std::size_t& moved,
                         unsigned timeout_ms) noexcept = 0;
  /// True once the program wants to stop: a start that waits for a person gives up.
  [[nodiscard]] virtual bool cancelled() const noexcept = 0;
};

}  // namespace haptic::hal
