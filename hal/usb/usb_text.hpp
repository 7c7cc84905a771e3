// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The meaning of libusb's codes, and what a person can do about them.

#include <cstdint>
#include <string>

#include "hal/device.hpp"

namespace haptic::hal {

/// The action during which libusb refused.
enum class UsbAction : std::uint8_t {
  kInitialise = 0,
  kFind,
  kOpen,
  kWrap,
  kConfigure,
  kClaim,
  kStart,
  kTransfer,
  kCount
};

/// A device as people name it.
struct UsbName {
  const char* name = "";  ///< of its driver
  std::uint16_t vendor_id = 0, product_id = 0;
};

/// Status of a libusb code met while doing `action`.
[[nodiscard]] HalStatus status_of_libusb(int code, UsbAction action) noexcept;

/// The libusb code that says what the end of a transfer (libusb_transfer_status) says.
[[nodiscard]] int code_of_transfer(int transfer_status) noexcept;

/// One or more lines: which device, what was tried, libusb's name of the code, and the fix (udev
/// rule, module to load, program to close).
[[nodiscard]] std::string usb_trouble(const UsbName& device, UsbAction action, int code,
                                      HalStatus status);

/// The same of a device that is not even looked for, with UsbProfile::holder's text.
[[nodiscard]] std::string usb_held(const UsbName& device, const std::string& holder);

/// For people who are on a device that states something else than the one before: force, torque,
/// change and reports of the one that is there now.
[[nodiscard]] std::string other_device_text(const DeviceCapabilities& stated);

/// The udev rule that lets the user who is logged in open the device, as a file's content.
[[nodiscard]] std::string udev_rule(const UsbName& device);

}  // namespace haptic::hal
