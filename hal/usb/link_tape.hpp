// SPDX-License-Identifier: Apache-2.0
#pragma once
/// All that a link takes in and gives out, in the order in which it does: time, turns, what ends on
/// the bus, commands taken, reports, sends. A link that is given the same again does the same
/// again, bit for bit; that is what a recording is made of, and what playing one compares.

#include <cstdint>
#include <span>

#include "rt_core/exchange/device_exchange.hpp"

namespace haptic::hal {

/// Values are those of the recording's file.
enum class LinkEventKind : std::uint8_t {
  kTurn = 1,       ///< UsbLink::poll begins
  kClock = 2,      ///< the link looked at its clock; stamp_ns
  kControl = 3,    ///< number: request_type, request, value, index from the lowest byte on; code:
                   ///< HalStatus; bytes: what moved
  kReport = 4,     ///< stamp_ns, code: ReportVerdict, number: sequence of the state, bytes
  kOutEnd = 5,     ///< code: OutEnd
  kLost = 6,       ///< the connection counts as lost from here on
  kCommand = 7,    ///< another command than before was taken; number: its tick, stamp_ns: its own
  kServoLost = 8,  ///< the call of that name was seen
  kSend = 9,       ///< stamp_ns, number: tick that it rests on, bytes
  kSendRefused = 10,  ///< the bus refused the submit
  kLink = 11,         ///< stamp_ns, code: LinkState, why: HalStatus
  kClose = 12,        ///< an orderly end begins
  kOutCleared = 13,   ///< the OUT endpoint's halt is cleared
  kStopCalled = 14,   ///< the call of emergency_stop was seen
  kSuspended = 15,    ///< the machine has slept; number: for how long in all [ns]
  kSwitches = 16      ///< others than before are pressed beside the device; number: their bits
};
inline constexpr std::uint8_t kMostLinkEventKind = 16;

enum class OutEnd : std::uint8_t { kDelivered = 0, kFailed, kStalled };

struct LinkEvent {
  LinkEventKind kind = LinkEventKind::kTurn;
  std::uint8_t code = 0, why = 0;
  std::int64_t stamp_ns = 0;
  std::uint64_t number = 0;
  std::span<const std::uint8_t> bytes = {};  ///< valid during the call
};

/// Called on the USB thread, within UsbLink's own calls. Must not block.
class LinkTape {
 public:
  virtual ~LinkTape() = default;
  virtual void on_event(const LinkEvent& event) noexcept = 0;
  /// Every state that the link publishes; follows from the events.
  virtual void on_state(const DeviceState& state) noexcept = 0;
};

}  // namespace haptic::hal
