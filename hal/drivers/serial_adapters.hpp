// SPDX-License-Identifier: Apache-2.0
#pragma once
/// USB devices that a bridge reaches by a serial port or by a vendor's library, for the udev rules
/// and the doctor, which follow from this table.

#include <cstdint>
#include <span>
#include <string_view>

namespace haptic::hal {

/// An adapter or a device with a serial port. Its chip may be in other products too, which get the
/// same rights.
struct SerialAdapter {
  std::uint16_t vendor_id = 0, product_id = 0;
  std::string_view name;           ///< for people
  std::string_view bridge;         ///< that opens its port, or whose library does
  bool has_latency_timer = false;  ///< an FTDI chip, which holds bytes back
};

/// Sources: U2D2 is an FT232H (ROBOTIS e-Manual, U2D2), whose number is FTDI's own for it; the
/// boards of SO-100 and SO-101 and Waveshare's adapter are a CH343 (lsusb, as udev rules of SO-101
/// users have it); the Touch is 0301:2988 with a CDC ACM port (README of sawSensablePhantom), later
/// ones 2988:0302.
[[nodiscard]] std::span<const SerialAdapter> serial_adapters() noexcept;

/// Null: none that is known.
[[nodiscard]] const SerialAdapter* find_serial_adapter(std::uint16_t vendor_id,
                                                       std::uint16_t product_id) noexcept;

/// All devices of Force Dimension have this vendor number (usb.ids: 1451 Force Dimension).
inline constexpr std::uint16_t kForceDimensionVendor = 0x1451;

}  // namespace haptic::hal
