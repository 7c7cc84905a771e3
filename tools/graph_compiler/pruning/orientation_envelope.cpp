// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/pruning/orientation_envelope.hpp"

namespace haptic::tools {

Rotation rotation_of(const std::array<double, 4>& xyzw) {
  const double x = xyzw[0], y = xyzw[1], z = xyzw[2], w = xyzw[3];
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
           {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
           {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

Direction rotated(const Rotation& r, const Direction& v) {
  Direction result{};
  for (std::size_t i = 0; i < 3; ++i) {
    result[i] = r[i][0] * v[0] + r[i][1] * v[1] + r[i][2] * v[2];
  }
  return result;
}

Rotation middle_of(const std::optional<OrientationEnvelope>& envelope) {
  return envelope ? rotation_of(envelope->about_xyzw) : rotation_of({0, 0, 0, 1});
}

double max_angle_of(const std::optional<OrientationEnvelope>& envelope) {
  return envelope && !envelope->is_free() ? envelope->max_angle_rad : std::numbers::pi;
}

}  // namespace haptic::tools
