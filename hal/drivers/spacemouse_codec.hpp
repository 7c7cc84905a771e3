// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The 3Dconnexion six-axis devices and their reports. Facts: spacenavd's dev_usb_freebsd.c (GPL-3;
/// facts only). The first byte is the report's number; numbers are little-endian.
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

// The 3Dconnexion devices by identity: which are six-axis devices, how their axes stand, and which
// must not be opened. Facts: the device table and the list of exceptions in spacenavd's dev.c
// (GPL-3; facts only).

inline constexpr std::uint16_t k3DconnexionId = 0x256f;  ///< USB vendor

/// How the device's own axes become those of D: x right, y away from the operator, z up. First the
/// exchange, then the signs; turns about the axes alike.
struct SpaceMouseAxes {
  bool swap_yz = false;
  bool invert_yz = false;
};

/// Current models report x right, y towards the operator, z down: a half turn about x. The older
/// ones, for which spacenavd's table has no flags, report up second and away third; that is no
/// rotation, so the signs of one of their axes stay to be confirmed on the device.
inline constexpr SpaceMouseAxes kCurrentAxes{false, true}, kOlderAxes{true, false};

struct SpaceMouseModel {
  std::uint16_t vendor_id, product_id;
  const char* name;
  bool joined;  ///< six axes in report 1; else three there and three in report 2. What is to be
                ///< expected: the descriptor, else the length of a report, decides
  SpaceMouseAxes axes;
  std::uint8_t interface_number;
};

/// All that spacenavd knows by name, but for the NuLOOQ (046d:c640), whose reports no source
/// describes, and the Universal Receiver, which it takes as it takes every new one of the maker's.
[[nodiscard]] std::span<const SpaceMouseModel> spacemouse_models() noexcept;

/// Null where the identity is none of the list.
[[nodiscard]] const SpaceMouseModel* find_spacemouse(std::uint16_t vendor_id,
                                                     std::uint16_t product_id) noexcept;

/// Devices of the same maker that are no six-axis devices - mice, keyboards, key pads -, on a list
/// of their own because a new product number of the maker's is otherwise taken for a six-axis
/// device when the user asks for it.
[[nodiscard]] bool is_refused_spacemouse(std::uint16_t vendor_id,
                                         std::uint16_t product_id) noexcept;

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

/// The last values of each kind that the device reported, in its own units and axes.
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
