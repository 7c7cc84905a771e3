// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A simulated device as the bus sees it, for tests: the three calls of a bus, and over them the
/// blocking port that a driver's start uses.

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/drivers/usb_port.hpp"

namespace haptic::test {

class DeviceCounterpart : public hal::UsbPort {
 public:
  bool gone = false;  ///< unplugged

  // Bytes.
  /// Answer to a control request in `bytes`; false: stall.
  virtual bool on_control(const hal::ControlRequest& /*request*/, std::span<std::uint8_t> /*bytes*/,
                          std::size_t& moved) {
    moved = 0;
    return false;
  }
  /// False: the device has no OUT endpoint.
  virtual bool on_out(std::span<const std::uint8_t> bytes) = 0;
  /// The next report; 0: none, the bus sees NAK.
  virtual std::size_t on_in(std::span<std::uint8_t> bytes) = 0;

  // UsbPort.
  hal::HalStatus control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                         std::size_t& moved, unsigned /*timeout_ms*/) noexcept final {
    moved = 0;
    if (is_gone()) return hal::HalStatus::kDeviceGone;
    return on_control(request, bytes, moved) ? hal::HalStatus::kOk
                                             : hal::HalStatus::kTransferFailed;
  }
  hal::HalStatus write(std::span<const std::uint8_t> bytes,
                       unsigned /*timeout_ms*/) noexcept final {
    if (is_gone()) return hal::HalStatus::kDeviceGone;
    return on_out(bytes) ? hal::HalStatus::kOk : hal::HalStatus::kDeviceUnfit;
  }
  hal::HalStatus read(std::span<std::uint8_t> bytes, std::size_t& moved,
                      unsigned /*timeout_ms*/) noexcept final {
    moved = 0;
    if (is_gone()) return hal::HalStatus::kDeviceGone;
    moved = on_in(bytes);
    return moved > 0 ? hal::HalStatus::kOk : hal::HalStatus::kTimeout;
  }
  [[nodiscard]] bool cancelled() const noexcept override { return false; }

 private:
  /// Asked once a call.
  virtual bool is_gone() { return gone; }
};

}  // namespace haptic::test
