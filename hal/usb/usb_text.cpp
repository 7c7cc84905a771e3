// SPDX-License-Identifier: Apache-2.0
#include "hal/usb/usb_text.hpp"

#include <libusb.h>
#include <unistd.h>

#include <cstddef>
#include <cstdio>

namespace haptic::hal {
namespace {

std::string identity(const UsbName& device) {
  char text[16];
  std::snprintf(text, sizeof text, "%04x:%04x", device.vendor_id, device.product_id);
  return text;
}

const char* words(UsbAction action) {
  static constexpr const char* kWords[] = {
      "libusb_init",          "search for the device", "libusb_open",      "wrap the descriptor",
      "read the descriptors", "claim the interface",   "start the device", "transfer"};
  static_assert(sizeof(kWords) / sizeof(kWords[0]) == static_cast<std::size_t>(UsbAction::kCount));
  return action < UsbAction::kCount ? kWords[static_cast<std::size_t>(action)] : "?";
}

bool machine_has_usb() { return access("/sys/bus/usb", F_OK) == 0; }

std::string fix_of(const UsbName& device, HalStatus status) {
  switch (status) {
    case HalStatus::kUsbUnavailable:
      return "Mend: load the USB modules (sudo modprobe usbcore; sudo modprobe xhci_pci) and see "
             "that "
             "/dev/bus/usb exists.";
    case HalStatus::kDeviceNotFound:
      return machine_has_usb()
                 ? "Mend: plug it in and switch it on; `lsusb` must list " + identity(device) + "."
                 : "This machine has no USB at all (/sys/bus/usb is absent). Mend: sudo modprobe "
                   "usbcore; sudo modprobe xhci_pci; in a container or virtual machine pass the "
                   "bus "
                   "on.";
    case HalStatus::kDeviceDenied:
      return "Mend: put this line into /etc/udev/rules.d/60-haptic.rules\n    " +
             udev_rule(device) +
             "\n  then: sudo udevadm control --reload; sudo udevadm trigger; and plug the device "
             "in "
             "again.";
    case HalStatus::kDeviceBusy:
      return "Mend: close the other program that uses the device; `lsusb -t` shows a kernel driver "
             "that holds it.";
    case HalStatus::kDeviceGone:
      return "Mend: check cable and power, and plug it in again.";
    case HalStatus::kDeviceUnfit:
      return "The device lacks the interface or the endpoints of this driver: another model or "
             "firmware.";
    case HalStatus::kTransferFailed:
      return "Mend: a shorter cable, another port, no hub; then plug it in again.";
    case HalStatus::kTimeout:
      return "Mend: switch the device off and on.";
    case HalStatus::kUnknownFirmwareFile:
      return "Give its hash (sha256sum FILE) in [device] firmware_sha256 once you know where the "
             "image is from, or set firmware_accept_unknown = true.";
    case HalStatus::kNoMemory:
      return "Mend: free memory; usbfs takes at most "
             "/sys/module/usbcore/parameters/usbfs_memory_mb.";
    default:
      return "";
  }
}

}  // namespace

int code_of_transfer(int transfer_status) noexcept {
  switch (transfer_status) {
    case LIBUSB_TRANSFER_COMPLETED:
      return 0;
    case LIBUSB_TRANSFER_NO_DEVICE:
      return LIBUSB_ERROR_NO_DEVICE;
    case LIBUSB_TRANSFER_STALL:
      return LIBUSB_ERROR_PIPE;
    case LIBUSB_TRANSFER_OVERFLOW:
      return LIBUSB_ERROR_OVERFLOW;
    case LIBUSB_TRANSFER_TIMED_OUT:
      return LIBUSB_ERROR_TIMEOUT;
    case LIBUSB_TRANSFER_CANCELLED:
      return LIBUSB_ERROR_INTERRUPTED;
    default:
      return LIBUSB_ERROR_IO;
  }
}

HalStatus status_of_libusb(int code, UsbAction action) noexcept {
  if (code >= 0) return HalStatus::kOk;
  if (action == UsbAction::kInitialise) return HalStatus::kUsbUnavailable;
  switch (code) {
    case LIBUSB_ERROR_NO_DEVICE:
      return HalStatus::kDeviceGone;
    case LIBUSB_ERROR_ACCESS:
      return HalStatus::kDeviceDenied;
    case LIBUSB_ERROR_BUSY:
      return HalStatus::kDeviceBusy;
    case LIBUSB_ERROR_NOT_FOUND:
      return action == UsbAction::kFind ? HalStatus::kDeviceNotFound : HalStatus::kDeviceUnfit;
    case LIBUSB_ERROR_TIMEOUT:
      return HalStatus::kTimeout;
    case LIBUSB_ERROR_NO_MEM:
      return HalStatus::kNoMemory;
    case LIBUSB_ERROR_PIPE:
    case LIBUSB_ERROR_OVERFLOW:
      return HalStatus::kTransferFailed;
    case LIBUSB_ERROR_IO:
      return action == UsbAction::kStart || action == UsbAction::kTransfer
                 ? HalStatus::kTransferFailed
                 : HalStatus::kOsRefused;
    default:
      return HalStatus::kOsRefused;
  }
}

std::string usb_trouble(const UsbName& device, UsbAction action, int code, HalStatus status) {
  std::string text = std::string(device.name) + " (" + identity(device) + "): " + words(action) +
                     ": " + to_text(status);
  if (code < 0) text += std::string(", ") + libusb_error_name(code);
  const std::string fix = fix_of(device, status);
  return fix.empty() ? text : text + "\n  " + fix;
}

std::string usb_held(const UsbName& device, const std::string& holder) {
  return std::string(device.name) + " (" + identity(device) + "): " + holder;
}

std::string other_device_text(const DeviceCapabilities& stated) {
  char numbers[160];
  std::snprintf(numbers, sizeof numbers,
                "%.4g N, %.4g N m, %.4g N/s, %.4g N m/s, a report every %.4g ms",
                static_cast<double>(stated.max_force_n), static_cast<double>(stated.max_torque_nm),
                static_cast<double>(stated.max_force_rate_n_per_s),
                static_cast<double>(stated.max_torque_rate_nm_per_s),
                1e-6 * static_cast<double>(stated.report_period_ns));
  return std::string("another device than before, by what it states of itself: ") + numbers +
         " (0: not known)\n  its limits hold from now on; release the deadman switch and press it "
         "again to go on";
}

std::string udev_rule(const UsbName& device) {
  const std::string both = identity(device);
  return "SUBSYSTEM==\"usb\", ATTR{idVendor}==\"" + both.substr(0, 4) + "\", ATTR{idProduct}==\"" +
         both.substr(5) + "\", MODE=\"0660\", TAG+=\"uaccess\"";
}

}  // namespace haptic::hal
