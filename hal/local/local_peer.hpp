// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The other end of a local link: something that speaks a device's bytes.

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/usb_port.hpp"

namespace haptic::hal {

/// Owner: the link's thread, which makes every call. Times are those of the monotonic clock [ns].
/// Nothing but `plug` and `control` may allocate or block.
class LocalPeer {
 public:
  virtual ~LocalPeer() = default;
  /// A host has come: reports begin. @return kOk, or why they cannot.
  virtual HalStatus plug(std::int64_t now_ns) noexcept = 0;
  /// A request of the driver's start; as UsbPort::control.
  virtual HalStatus control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                            std::size_t& moved) noexcept = 0;
  /// When the next report is due.
  [[nodiscard]] virtual std::int64_t next_report_ns() const noexcept = 0;
  /// Writes the newest report that is due and returns its length; 0: none is. `sampled_ns`: when
  /// the device made it, by its own word; it comes in as `now_ns`.
  virtual std::size_t report(std::int64_t now_ns, std::span<std::uint8_t> bytes,
                             std::int64_t& sampled_ns) noexcept = 0;
  /// A report from the host.
  virtual void command(std::int64_t now_ns, std::span<const std::uint8_t> bytes) noexcept = 0;

  // A peer behind a descriptor; the others are always there, and wait by the clock.

  /// Sleeps until `until_ns`, or until there is something to read.
  virtual void wait(std::int64_t until_ns) noexcept { (void)sleep_until(until_ns); }
  /// Outside of the flow, as UsbPort::write and read.
  virtual HalStatus write(std::span<const std::uint8_t> /*bytes*/) noexcept {
    return HalStatus::kTransferFailed;
  }
  virtual HalStatus read(std::span<std::uint8_t> /*bytes*/, std::size_t& /*moved*/,
                         unsigned /*timeout_ms*/) noexcept {
    return HalStatus::kTransferFailed;
  }
  /// It has closed its end.
  [[nodiscard]] virtual bool gone() const noexcept { return false; }
  /// The host has gone.
  virtual void unplug() noexcept {}
  /// That a zero command is sent over; negative: there is none.
  [[nodiscard]] virtual int descriptor() const noexcept { return -1; }
  /// "the local device".
  [[nodiscard]] virtual const char* name() const noexcept { return "the local device"; }
};

}  // namespace haptic::hal
