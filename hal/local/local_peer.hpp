// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The other end of a local link: something that speaks a device's bytes within this process.

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/drivers/usb_port.hpp"

namespace haptic::hal {

/// Owner: the link's thread, which makes every call. Times are those of the monotonic clock [ns].
/// Nothing but `control` may allocate or block.
class LocalPeer {
 public:
  virtual ~LocalPeer() = default;
  /// A host has come: reports begin.
  virtual void plug(std::int64_t now_ns) noexcept = 0;
  /// A request of the driver's start; as UsbPort::control.
  virtual HalStatus control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                            std::size_t& moved) noexcept = 0;
  /// When the next report is due.
  [[nodiscard]] virtual std::int64_t next_report_ns() const noexcept = 0;
  /// Writes the newest report that is due and returns its length; 0: none is.
  virtual std::size_t report(std::int64_t now_ns, std::span<std::uint8_t> bytes) noexcept = 0;
  /// A report from the host.
  virtual void command(std::int64_t now_ns, std::span<const std::uint8_t> bytes) noexcept = 0;
};

}  // namespace haptic::hal
