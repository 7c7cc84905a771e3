// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Places of meshes that may also scale, shear and mirror.

#include <array>
#include <cstddef>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

/// Three rows: what x, y and z are multiplied by, then the shift.
using AffineMap = std::array<std::array<double, 4>, 3>;

inline constexpr AffineMap kNoMove{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

inline Point3 mapped(const AffineMap& map, const Point3& p) {
  Point3 to{};
  for (std::size_t i = 0; i < 3; ++i) {
    to[i] = map[i][0] * p[0] + map[i][1] * p[1] + map[i][2] * p[2] + map[i][3];
  }
  return to;
}

/// First `inner`, then `outer`.
inline AffineMap product(const AffineMap& outer, const AffineMap& inner) {
  AffineMap both{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      for (std::size_t k = 0; k < 3; ++k) both[i][j] += outer[i][k] * inner[k][j];
    }
    both[i][3] += outer[i][3];
  }
  return both;
}

/// Below 0: the map mirrors, and turns meshes inside out.
inline double determinant(const AffineMap& m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
         m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

}  // namespace haptic::tools
