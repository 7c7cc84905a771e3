// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Scenes at the edges of what coordinates can hold: sizes from 1e-6 to 1e3 m, needles and plates,
/// bodies far from the origin, edges and faces a hair from parallel, faces of many vertices.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

/// One pair of convex bodies and how A stands to B.
struct ExtremeScene {
  std::string family;  ///< letters and underscores: what is driven to the extreme
  double parameter = 0;
  std::string unit;     ///< of the parameter
  double size_m = 0.1;  ///< the larger body's
  Solid a, b;
  Vector place_w = Vector::Zero();         ///< of B's origin [m]
  Rotation turn_w = Rotation::Identity();  ///< of B
  /// A's orientation against B in a draw; uniform over the rotations where empty.
  std::function<Rotation(Seeded&)> rotation;
  /// Outside what a scene may hold: the writer must refuse it.
  bool refused = false;
};

/// Stiffness of all of them, proxy and other laws alike.
inline constexpr double kExtremeStiffness_n_per_m = 1000.0;

/// Scenes in which D_near and its normal are compared with the search in long double, and those
/// that are refused. `quick`: the ends of each family.
[[nodiscard]] std::vector<ExtremeScene> extreme_scenes(bool quick);

/// Bytes of the compiled scene, grip point at A's origin, D_near exact at any distance.
/// @throws tools::InputError when it is refused.
[[nodiscard]] std::vector<std::byte> compiled(const ExtremeScene& scene, LawId law);

/// The solid with all lengths `factor` times as large, or factors by axis.
[[nodiscard]] Solid scaled(const Solid& solid, double factor);
[[nodiscard]] Solid scaled(const Solid& solid, const Vector& factors);

}  // namespace haptic::sim
