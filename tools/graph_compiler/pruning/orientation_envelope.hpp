// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which basic contacts can occur while the orientation of the moving part stays in its envelope.
/// A contact of features f_A and f_B is applicable at R iff -R S(f_A) meets S(f_B), S being the
/// outward normals of a feature. A turn by at most alpha moves no direction by more than alpha, and
/// some turn by beta brings together any two directions at angle beta: so a contact occurs in the
/// envelope {R : angle(R R0^T) <= alpha} iff the angle between -R0 S(f_A) and S(f_B) is at most
/// alpha.

#include <numbers>
#include <optional>

#include "tools/graph_compiler/graph/pruning_marks.hpp"
#include "tools/graph_compiler/pruning/spherical_sets.hpp"

namespace haptic::tools {

/// Kept beyond the envelope [rad]: rounding, and ties of 1e-9 m over edges of 1 mm and more that
/// the loop counts as applicable.
inline constexpr double kEnvelopeMargin_rad = 1.0e-6;

/// Rotation, or rotation and inversion, as a matrix by rows.
using Rotation = std::array<std::array<double, 3>, 3>;
/// Rotation of a unit quaternion (x, y, z, w).
Rotation rotation_of(const std::array<double, 4>& xyzw);
Direction rotated(const Rotation& r, const Direction& v);

/// R0, and the angle about it; identity and pi where every orientation is allowed.
Rotation middle_of(const std::optional<OrientationEnvelope>& envelope);
double max_angle_of(const std::optional<OrientationEnvelope>& envelope);

/// True when a rotation of the envelope brings two sets of normals together; `of_a` has been turned
/// by -R0. One of the sets is an arc or a polygon, as the type of contact has it.
template <typename OfA, typename OfB>
bool within_envelope(const OfA& of_a, const OfB& of_b, double max_angle_rad) {
  return max_angle_rad >= std::numbers::pi ||
         angle_to(of_a, of_b) <= max_angle_rad + kEnvelopeMargin_rad;
}

}  // namespace haptic::tools
