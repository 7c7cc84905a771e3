// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The 3Dconnexion devices by identity: which are six-axis devices, how their axes stand, and which
/// must not be opened. Facts: the device table and the list of exceptions in spacenavd's dev.c
/// (GPL-3; facts only).

#include <cstdint>
#include <span>

namespace haptic::hal {

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

[[nodiscard]] std::span<const SpaceMouseModel> spacemouse_models() noexcept;

/// Null where the identity is none of the list.
[[nodiscard]] const SpaceMouseModel* find_spacemouse(std::uint16_t vendor_id,
                                                     std::uint16_t product_id) noexcept;

/// Devices of the same maker that are no six-axis devices - mice, keyboards, key pads -, on a list
/// of their own because a new product number of the maker's is otherwise taken for a six-axis
/// device when the user asks for it.
[[nodiscard]] bool is_refused_spacemouse(std::uint16_t vendor_id,
                                         std::uint16_t product_id) noexcept;

}  // namespace haptic::hal
