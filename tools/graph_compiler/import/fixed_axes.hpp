// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Turns as robot descriptions and AMF write them.

#include <array>
#include <cmath>

namespace haptic::tools {

using Turn = std::array<std::array<double, 3>, 3>;

/// Turns about the fixed axes x, y and z, in this order, by these angles [rad].
inline Turn turn_about_fixed_axes(const std::array<double, 3>& angles_rad) {
  const double cr = std::cos(angles_rad[0]), sr = std::sin(angles_rad[0]),
               cp = std::cos(angles_rad[1]), sp = std::sin(angles_rad[1]),
               cy = std::cos(angles_rad[2]), sy = std::sin(angles_rad[2]);
  return {{{cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr},
           {sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr},
           {-sp, cp * sr, cp * cr}}};
}

}  // namespace haptic::tools
