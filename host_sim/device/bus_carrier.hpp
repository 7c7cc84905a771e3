// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A USB device without hardware, in two halves: what it answers (UsbFunction), and the bus that it
/// is plugged into (BusCarrier). The same function goes on every carrier.

#include <cstdint>
#include <span>
#include <vector>

namespace haptic::sim {

/// The device's side of a carrier. Called on a thread of the carrier, see there; no lock of the
/// carrier is held, so it may push, fail and unplug from within.
class UsbFunction {
 public:
  virtual ~UsbFunction() = default;
  /// Device descriptor followed by the configuration descriptors, as usbfs gives them.
  [[nodiscard]] virtual std::vector<std::uint8_t> descriptors() const = 0;
  /// 3 = high, 2 = full.
  [[nodiscard]] virtual int speed() const = 0;
  /// Control request on endpoint 0; returns bytes moved, or a negative errno. Requests that ask for
  /// what `descriptors` holds, or for a status, are answered by the carrier (UsbDescriptors);
  /// CLEAR_FEATURE (halt), SET_CONFIGURATION, SET_INTERFACE and string descriptors come here, and
  /// their refusal is the host's.
  virtual int control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                      std::uint16_t index, std::span<std::uint8_t> bytes) = 0;
  /// OUT transfer; returns bytes taken, or a negative errno.
  virtual int out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) = 0;
};

/// One end of the bus. Reports are pushed; an IN transfer that waits is completed by the next; a
/// report is a whole transfer, regardless of the packet size. All members but the destructor and
/// `close` may be called from any thread. The function outlives the carrier's last call of it.
class BusCarrier {
 public:
  /// Reports kept on each IN endpoint while no transfer waits: the newest.
  static constexpr unsigned kRoom = 1;

  virtual ~BusCarrier() = default;

  /// The host's end; its number is that of no other carrier which still exists.
  [[nodiscard]] virtual int descriptor() const = 0;

  /// The device has this to say on an IN endpoint; kept until a transfer waits for it, at most
  /// `room` reports, the oldest lost. Longer than the transfer: -EOVERFLOW. Returns false when one
  /// was lost, or there is no such endpoint, or the device is unplugged. During UsbFunction::out it
  /// is kept back until that transfer has ended, as the bus would.
  virtual bool push(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) = 0;

  /// The next transfer on the endpoint that would complete fails with this errno (-EPIPE stall,
  /// -EOVERFLOW babble, -EPROTO bus error), `times` times; its bytes are lost. Endpoint 0: control.
  virtual void fail_next(std::uint8_t endpoint, int negative_errno, unsigned times) = 0;
  /// The next submits of the endpoint are refused with this errno (-ENOMEM).
  virtual void refuse_submit(std::uint8_t endpoint, int negative_errno, unsigned times) = 0;

  virtual void unplug() = 0;                   ///< pending transfers end without a device
  virtual void unplug_at_next_resubmit() = 0;  ///< between a completion and the resubmit after it
  [[nodiscard]] virtual bool plugged() const = 0;

  /// Unplugs; the carrier's own threads have left the function when it returns. Not from within a
  /// call of the function.
  virtual void close() = 0;
};

}  // namespace haptic::sim
