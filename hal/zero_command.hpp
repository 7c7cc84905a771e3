// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The one command that needs no servo, no driver and no libusb: zero force, as bytes that were
/// made beforehand, over a descriptor of the open device. Who holds it can take the force away when
/// all others are gone; it can do nothing else.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace haptic::hal {

/// Devices that one process holds at most.
inline constexpr std::size_t kMostDevices = 2;

struct ZeroCommand {
  static constexpr std::size_t kMostBytes = 128;

  int descriptor = -1;                           ///< of the device: usbfs, or a local link's socket
  std::uint8_t endpoint = 0;                     ///< OUT, of usbfs
  std::uint32_t size = 0;                        ///< bytes; 0: the device takes none
  std::int64_t watchdog_ns = 0;                  ///< DeviceCapabilities::watchdog_ns
  std::array<std::uint8_t, kMostBytes> bytes{};  ///< from Driver::zero_report
};

/// Hands it to the kernel. Async-signal-safe; blocks for at most 50 ms. False: refused.
bool send_zero(const ZeroCommand& command) noexcept;

/// Who is given the zero command of the device that is open: another process (ZeroKeeper).
class ZeroHolder {
 public:
  virtual ~ZeroHolder() = default;
  /// The device is open and calibrated. The descriptor stays the caller's; the holder makes its own
  /// duplicate. Called on the link's thread, which it does not keep waiting.
  virtual void hold(const ZeroCommand& command) noexcept = 0;
  /// The device is about to be closed, or gone.
  virtual void release() noexcept = 0;
  /// Grows whenever the holder has sent it of its own accord: the device has zero then, no matter
  /// what the link sent last.
  [[nodiscard]] virtual std::uint32_t sent() const noexcept = 0;
};

}  // namespace haptic::hal
