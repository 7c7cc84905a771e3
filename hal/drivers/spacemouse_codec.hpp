// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Reports of the 3Dconnexion six-axis devices. Facts: spacenavd's dev_usb_freebsd.c (GPL-3; facts
/// only). The first byte is the report's number; numbers are little-endian.
///   1  three signed 16-bit displacements X Y Z; on newer devices six: X Y Z RX RY RZ
///   2  RX RY RZ, on devices that send three
///   3  buttons, one bit each
///   23 charge of the battery in percent
///   4  to the device: light, on where not zero

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace haptic::hal {

inline constexpr std::size_t kSpaceMouseShortBytes = 7, kSpaceMouseLongBytes = 13;
inline constexpr std::uint8_t kSpaceMouseLightReport = 4;

enum class SpaceMouseReport : std::uint8_t {
  kTranslation = 0,  ///< axes 0-2 are new
  kRotation,         ///< axes 3-5 are new
  kAllAxes,
  kButtons,
  kBattery,
  kUnknown,   ///< a number that is none of the above: no error
  kBadLength  ///< nothing is new
};

/// What the device said last of each kind, in its own units and axes.
struct SpaceMouseInput {
  std::array<std::int16_t, 6> axes{};
  std::uint32_t buttons = 0;  ///< the first 32
  std::uint8_t battery_percent = 0;
};

/// Updates the parts of `input` that the report holds; bytes behind those are ignored.
/// @param may_be_joined  false where the descriptor puts turns into a report of their own: a long
///                       report 1 then still has three axes.
[[nodiscard]] SpaceMouseReport decode(std::span<const std::uint8_t> report, bool may_be_joined,
                                      SpaceMouseInput& input) noexcept;

/// The device's side, for tests and recorded sessions.
[[nodiscard]] std::array<std::uint8_t, kSpaceMouseShortBytes> encode_short(
    std::uint8_t number, std::span<const std::int16_t, 3> values) noexcept;
[[nodiscard]] std::array<std::uint8_t, kSpaceMouseLongBytes> encode_long(
    std::span<const std::int16_t, 6> values) noexcept;

}  // namespace haptic::hal
