// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A USB device behind USB/IP: this end of a socket pair answers transfers, the other is handed to
/// whoever plays the host, which is the kernel's vhci-hcd (attach_to_vhci) or a test. With the
/// kernel the device is one like any other: lsusb shows it, udev rules apply, every program can
/// open it.

#include <memory>
#include <thread>

#include "host_sim/device/bus_carrier.hpp"

namespace haptic::sim {

/// A thread of its own serves the host; the function is called on it. As on a wire:
/// - An IN transfer is held until there is a report, which is how a device NAKs.
/// - A refused submit cannot be distinguished from a transfer that failed: it ends with that errno.
/// - unplug_at_next_resubmit: off the bus right behind the next report; transfers that were already
///   queued end without a device, and so does the resubmit.
/// A host that sends what is no USB/IP, or does not take what it is sent, is cut off: unplugged.
class UsbipCarrier final : public BusCarrier {
 public:
  /// @throws std::system_error  no socket pair; tools::InputError  descriptors that are none.
  explicit UsbipCarrier(UsbFunction& function, unsigned room = kRoom);
  ~UsbipCarrier() override;
  UsbipCarrier(const UsbipCarrier&) = delete;
  UsbipCarrier& operator=(const UsbipCarrier&) = delete;

  /// The host's end of the socket pair; open as long as the carrier lives.
  [[nodiscard]] int descriptor() const override;

  bool push(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) override;
  void fail_next(std::uint8_t endpoint, int negative_errno, unsigned times) override;
  void refuse_submit(std::uint8_t endpoint, int negative_errno, unsigned times) override;
  void unplug() override;
  void unplug_at_next_resubmit() override;
  [[nodiscard]] bool plugged() const override;
  void close() override;

 private:
  class Bus;
  std::shared_ptr<Bus> bus_;  ///< shared with the thread
  std::thread thread_;
};

}  // namespace haptic::sim
