// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A USB device inside this process, under the real libusb: ioctl, read and lseek of the descriptor
/// that libusb is given are answered here, everything else goes to the kernel. Needs neither
/// hardware nor rights. The program links the object library haptic_usbfs and exports its symbols
/// (CMake ENABLE_EXPORTS), so that the shared libusb resolves to ours.

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>

#include "host_sim/device/bus_carrier.hpp"

namespace haptic::sim {

class UsbfsBus;

/// One end of the fake bus. The function is called from the thread that calls libusb. Both
/// `function` and the carrier must outlive the libusb handle.
class UsbfsCarrier final : public BusCarrier {
 public:
  /// @throws std::system_error  the kernel refuses a pipe; tools::InputError  descriptors that are
  ///         none; std::logic_error  the program lacks haptic_usbfs or ENABLE_EXPORTS.
  explicit UsbfsCarrier(UsbFunction& function, unsigned room = kRoom);
  ~UsbfsCarrier() override;
  UsbfsCarrier(const UsbfsCarrier&) = delete;
  UsbfsCarrier& operator=(const UsbfsCarrier&) = delete;

  /// To be given to libusb_wrap_sys_device (UsbAddress::wrapped_fd).
  [[nodiscard]] int descriptor() const override;

  bool push(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) override;
  void fail_next(std::uint8_t endpoint, int negative_errno, unsigned times = 1) override;
  void refuse_submit(std::uint8_t endpoint, int negative_errno, unsigned times = 1) override;
  /// OUT transfers stay in flight until released; those that waited go to the device in order, on
  /// the thread that releases.
  void hold_out(bool held);

  /// Control requests are not answered until released: a transfer stays in flight, and the call of
  /// usbfs that clears a halt waits, as the kernel does, for kHeldCall.
  void hold_control(bool held);
  static constexpr std::chrono::milliseconds kHeldCall{5000};

  void unplug() override;  ///< pending transfers end with -ESHUTDOWN
  void unplug_at_next_resubmit() override;
  [[nodiscard]] bool plugged() const override;
  void close() override { unplug(); }  ///< it has no threads

  [[nodiscard]] unsigned waiting(std::uint8_t endpoint) const;  ///< transfers in flight

 private:
  std::shared_ptr<UsbfsBus> bus_;
};

}  // namespace haptic::sim
