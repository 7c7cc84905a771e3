// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The protocol of spacenavd and its clients over a stream socket, versions 0 and 1: units of eight
/// 32-bit integers in the order of the machine. Facts: spacenavd's proto.h and
/// proto_unix.c (GPL-3; facts only), libspnav's spnav.c (BSD).
///
/// A connection begins in version 0: units from the daemon are events, and each four bytes to it
/// are a sensitivity, a float. kSpnavChangeProtocol, a NaN as a float, asks for version 1; a daemon
/// that knows it answers with these four bytes, its version in the last, between any two units.
/// From then on units go both ways, and the daemon's are events or answers.
///
/// Axes of a motion are right, up, away, with turns about them alike, once the daemon has evened
/// out its models (its dev.c: y and z exchanged, then their signs changed, for all that report
/// right, towards, down). That is D's x, z, y.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace haptic::tools {

inline constexpr std::size_t kSpnavUnitBytes = 32;
inline constexpr std::int32_t kSpnavChangeProtocol = 0x7faa5500;  ///< | version
inline constexpr std::int32_t kSpnavVersion = 1;                  ///< the newest that is known here

struct SpnavUnit {
  std::int32_t type = 0;
  std::array<std::int32_t, 7> data{};
};
static_assert(sizeof(SpnavUnit) == kSpnavUnitBytes);

/// Types of events. Motion: x y z, turns about them, milliseconds since the last one. Button:
/// number from 0. Device: SpnavDeviceEvent, number, type, USB vendor and product.
enum SpnavEvent : std::int32_t {
  kSpnavMotion = 0,
  kSpnavPress = 1,
  kSpnavRelease = 2,
  kSpnavDevice = 3,         ///< version 1, as all below
  kSpnavConfiguration = 4,  ///< a setting of the daemon's has changed
  kSpnavRawAxis = 5,
  kSpnavRawButton = 6
};
enum SpnavDeviceEvent : std::int32_t { kSpnavAdded = 0, kSpnavRemoved = 1 };
enum SpnavMask : std::int32_t { kSpnavMaskMotion = 1, kSpnavMaskButton = 2, kSpnavMaskDevice = 4 };

/// Requests of version 1. An answer has the request's type, and a negative last integer where it
/// was refused. The name of the client has no answer in spacenavd 1.1.
enum SpnavRequest : std::int32_t {
  kSpnavSetName = 0x1000,         ///< 24 bytes of text, last integer: length
  kSpnavSetSensitivity = 0x1001,  ///< a float
  kSpnavSetEventMask = 0x1003,    ///< SpnavMask
  kSpnavDeviceName = 0x2000,      ///< answered by as many units as the text needs
  kSpnavDeviceUsb = 0x2004        ///< vendor, product; refused by a device on a serial line
};

/// The largest number of a device's report; a daemon whose sensitivity is a NaN sends
/// INT_MIN.
inline constexpr std::int32_t kSpnavMostAxis = 32768;
inline constexpr std::size_t kSpnavMostText = 4096;

/// A request as it goes out. `text`: its first 24 bytes.
[[nodiscard]] SpnavUnit spnav_request(SpnavRequest request, std::int32_t first = 0);
[[nodiscard]] SpnavUnit spnav_request(SpnavRequest request, const std::string& text);
/// To this request, or to any.
[[nodiscard]] bool is_answer(const SpnavUnit& unit, SpnavRequest request) noexcept;
[[nodiscard]] bool is_answer(const SpnavUnit& unit) noexcept;
[[nodiscard]] bool is_refused(const SpnavUnit& answer) noexcept;

/// A text that comes in pieces of 24 bytes: the first says the length, the others what is left.
class SpnavText {
 public:
  enum class State : std::uint8_t { kMore = 0, kWhole, kRefused };
  [[nodiscard]] State add(const SpnavUnit& answer);
  /// Printable ASCII; anything else is a question mark.
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

 private:
  std::string text_;
  std::size_t left_ = 0;
  bool begun_ = false;
};

/// Cuts what comes into units. Holds 64 of them; a part of one stays until the rest comes.
class SpnavStream {
 public:
  enum class Item : std::uint8_t {
    kNone = 0,
    kUnit,
    kVersion  ///< the daemon's answer to kSpnavChangeProtocol
  };

  void reset() noexcept { begin_ = end_ = 0; }
  /// Where to put the next bytes; never empty once `next` has said kNone.
  [[nodiscard]] std::span<std::byte> room() noexcept;
  void added(std::size_t bytes) noexcept { end_ += bytes; }
  /// @param unit  for kVersion: the version in data[0].
  [[nodiscard]] Item next(SpnavUnit& unit) noexcept;

 private:
  std::array<std::byte, 64 * kSpnavUnitBytes> bytes_{};
  std::size_t begin_ = 0, end_ = 0;
};

}  // namespace haptic::tools
