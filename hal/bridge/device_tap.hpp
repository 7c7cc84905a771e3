// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The place at which all passes that a bridge and its device say to each other. While a device is
/// used, a tap keeps it; in a replay the tap says it instead of the device, so that the same code
/// makes the same poses of it.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace haptic::hal {

/// Entries of a recording. Numbers are part of the format of the file: none is used twice.
enum class TapKind : std::uint8_t {
  kBegin = 1,      ///< received: the bridge and its keys, JSON
  kEnd = 2,        ///< result: why the recording ends
  kOpen = 3,       ///< the bridge opens its device
  kOpened = 4,     ///< result: 1, it is open; received: its name and words, or why it is not
  kRead = 5,       ///< the bridge looks for a sample; result: its time [ns]
  kLooked = 6,     ///< result: BridgeRead; received: the sample, where it is new
  kWrite = 7,      ///< result: the time [ns]; sent: the wrench
  kRelease = 8,    ///< result: the time [ns]
  kClose = 9,      ///< the bridge closes its device
  kClock = 10,     ///< result: CLOCK_MONOTONIC [ns], as a device's code has read it
  kReady = 11,     ///< result: of a wait for bytes
  kConnect = 12,   ///< result: of opening a port or socket
  kSent = 13,      ///< bytes to the device; result: as of write(2)
  kReceived = 14,  ///< bytes of the device; result: as of read(2)
  kAsked = 15,     ///< an HTTP request: sent, received, result: status
  kMessage = 16,   ///< a message of a service, whole: sent or received
  kChosen = 17,    ///< the device of a service that is used
  kSettings = 18,  ///< of a device behind a vendor's library
  kSense = 19,     ///< the library's thread asks for a sample
  kSensed = 20,    ///< result: how that went; received: the sample
  kExert = 21,     ///< result: drives; sent: the wrench
  kExerted = 22,   ///< result: how that went
  kCall = 23,      ///< of a library; sent: the function and its arguments; received: its outputs
  kParsed = 24     ///< what was read from the message before; result: a verdict
};
inline constexpr std::uint8_t kLastTapKind = 24;

/// Any thread, but one entry of a sequence at a time.
class DeviceTap {
 public:
  virtual ~DeviceTap() = default;
  [[nodiscard]] virtual bool is_replay() const noexcept = 0;
  /// Keeps an entry. Never waits, takes no memory, makes no system call.
  virtual void note(TapKind kind, std::int64_t result, std::span<const std::byte> sent,
                    std::span<const std::byte> received) noexcept = 0;
  /// Replay: the next entry, which must be of this kind and have the same `sent`. Fills `room`.
  /// @return its result; -1 once the replay has gone another way.
  [[nodiscard]] virtual std::int64_t give(TapKind kind, std::span<const std::byte> sent,
                                          std::span<std::byte> room) noexcept = 0;
};

/// Calls `live`, and lets `tap` keep what it says and does; in a replay gives what was kept
/// instead.
/// @param room  receives; of a kCall all of it, else as many bytes as the result says.
template <typename Live>
[[nodiscard]] std::int64_t through(DeviceTap* tap, TapKind kind, std::span<const std::byte> sent,
                                   std::span<std::byte> room, const Live& live) noexcept {
  if (tap == nullptr) return static_cast<std::int64_t>(live());
  if (tap->is_replay()) return tap->give(kind, sent, room);
  const auto result = static_cast<std::int64_t>(live());
  const std::size_t filled =
      kind == TapKind::kCall
          ? room.size()
          : std::min(room.size(), static_cast<std::size_t>(std::max<std::int64_t>(result, 0)));
  tap->note(kind, result, sent, room.first(filled));
  return result;
}

}  // namespace haptic::hal
