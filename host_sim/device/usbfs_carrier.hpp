// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A USB device inside this process, under the real libusb: ioctl, read and lseek of the descriptor
/// that libusb is given are answered here, everything else goes to the kernel. Needs neither
/// hardware nor rights. The program links the object library haptic_usbfs and exports its symbols
/// (CMake ENABLE_EXPORTS), so that the shared libusb resolves to ours.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace haptic::sim {

class UsbfsBus;

/// What stands behind the descriptor. Called from the thread that calls libusb, except where said;
/// no lock of the carrier is held, so it may push, fail and unplug from within.
class UsbFunction {
 public:
  virtual ~UsbFunction() = default;
  /// Device descriptor followed by the configuration descriptors, as usbfs gives them.
  [[nodiscard]] virtual std::vector<std::uint8_t> descriptors() const = 0;
  /// 3 = high, 2 = full.
  [[nodiscard]] virtual int speed() const = 0;
  /// Control request on endpoint 0; returns bytes moved, or a negative errno. GET_CONFIGURATION and
  /// GET_DESCRIPTOR of what `descriptors` holds are answered by the carrier; CLEAR_FEATURE (halt),
  /// SET_CONFIGURATION and SET_INTERFACE come here, and their refusal is the host's.
  virtual int control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                      std::uint16_t index, std::span<std::uint8_t> bytes) = 0;
  /// OUT transfer; returns bytes taken, or a negative errno.
  virtual int out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) = 0;
};

/// One end of the fake bus. Reports are pushed; an IN transfer that waits is completed by the next;
/// a report is a whole transfer, whatever the packet size. All members but the destructor may be
/// called from any thread. Both `function` and the carrier must outlive the libusb handle.
class UsbfsCarrier {
 public:
  /// Reports kept on each IN endpoint while no transfer waits.
  static constexpr unsigned kRoom = 2;

  /// @throws std::system_error  the kernel refuses a pipe; tools::InputError  descriptors that are
  ///         none; std::logic_error  the program lacks haptic_usbfs or ENABLE_EXPORTS.
  explicit UsbfsCarrier(UsbFunction& function, unsigned room = kRoom);
  ~UsbfsCarrier();
  UsbfsCarrier(const UsbfsCarrier&) = delete;
  UsbfsCarrier& operator=(const UsbfsCarrier&) = delete;

  /// To be given to libusb_wrap_sys_device (UsbAddress::wrapped_fd).
  [[nodiscard]] int descriptor() const;

  /// The device has this to say on an IN endpoint; kept until a transfer waits for it, at most
  /// `room` reports, the oldest lost. Longer than the transfer: -EOVERFLOW. Returns false when one
  /// was lost, or there is no such endpoint, or the device is unplugged. During UsbFunction::out it
  /// is kept back until that transfer has ended, as the bus would.
  bool push(std::uint8_t endpoint, std::span<const std::uint8_t> bytes);

  /// The next transfer on the endpoint that would complete fails with this errno (-EPIPE stall,
  /// -EOVERFLOW babble, -EPROTO bus error), `times` times; its bytes are lost. Endpoint 0: control.
  void fail_next(std::uint8_t endpoint, int negative_errno, unsigned times = 1);
  /// The next submits of the endpoint are refused with this errno (-ENOMEM).
  void refuse_submit(std::uint8_t endpoint, int negative_errno, unsigned times = 1);
  /// OUT transfers stay in flight until released; those that waited go to the device in order, on
  /// the thread that releases.
  void hold_out(bool held);

  void unplug();                   ///< pending transfers end with -ESHUTDOWN
  void unplug_at_next_resubmit();  ///< between a completion and the resubmit in its callback
  [[nodiscard]] bool plugged() const;

  [[nodiscard]] unsigned waiting(std::uint8_t endpoint) const;  ///< transfers in flight

 private:
  std::shared_ptr<UsbfsBus> bus_;
};

}  // namespace haptic::sim
