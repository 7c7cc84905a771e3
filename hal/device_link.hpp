// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One device as the thread that holds it sees it, over any connection: a bus (usb/usb_link.hpp)
/// or the same process (local/local_link.hpp).

#include <cstdint>
#include <string>

#include "hal/device.hpp"
#include "hal/device_mailbox.hpp"
#include "hal/link_counters.hpp"

namespace haptic::hal {

class LinkObserver;

/// Owner: the link's thread, which calls `poll` and `close`; what may be called from any thread
/// says so.
class DeviceLink {
 public:
  virtual ~DeviceLink() = default;

  /// Before the first poll; null: none.
  virtual void observe(LinkObserver* observer) noexcept = 0;

  /// One turn: tries to connect where there is no device, else takes reports and sends commands,
  /// waiting at most `timeout_ns`. Call it again at once, with at most half a period. Never throws;
  /// the status is the link's condition, kOk while reports can flow.
  virtual HalStatus poll(std::int64_t timeout_ns) noexcept = 0;

  /// Orderly end: ramp to zero and its delivery (bounded: 0.3 s), then the device is closed. A poll
  /// after it opens again.
  virtual void close() noexcept = 0;

  /// From any thread: makes poll return soon; until `close` nothing is opened any more.
  virtual void cancel() noexcept = 0;
  /// From any thread: the servo process ended; ramp to zero, latch kLinkServoLost.
  virtual void servo_lost() noexcept = 0;
  /// From any thread: another servo process has taken over and has its own mailbox, since what a
  /// killed one left half done in its own cannot be known. `mailbox` outlives the link, and so does
  /// the one before.
  virtual void use_mailbox(DeviceMailbox& mailbox) noexcept = 0;

  // From any thread.
  [[nodiscard]] virtual LinkState state() const noexcept = 0;
  [[nodiscard]] virtual LinkCounters counters() const noexcept = 0;
  /// Text of the last trouble and what to do, for people; not for the loop.
  [[nodiscard]] virtual std::string trouble() const = 0;
};

}  // namespace haptic::hal
