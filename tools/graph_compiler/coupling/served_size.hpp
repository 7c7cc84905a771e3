// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Lengths of the proxy law at the size of a scene, and the sizes that it serves. All lengths of
/// the law are stated for a part of radius r_A = 50 mm about its grip and grow in proportion; the
/// rounding of the coordinates sets the floor of its tolerance.

#include <string>

#include "rt_core/scene/scene_view.hpp"

namespace haptic::tools {

/// r_A for which the law's lengths are stated, and its tolerance there [m].
inline constexpr double kReferenceRadius_m = 0.05;
inline constexpr double kReferenceTolerance_m = 1.0e-7;
/// The tolerance is never below this many roundings of the largest coordinate.
inline constexpr double kToleranceRoundings = 64.0;
/// Largest tolerance as a share of r_A: 1/40 of the step that a pass may take. A floor above it
/// would hide features of the part.
inline constexpr double kLargestToleranceShare = 1.0e-3;
/// Radii r_A that are served [m].
inline constexpr double kLeastRadius_m = 1.0e-7, kLargestRadius_m = 1.0e4;

struct ServedSize {
  double radius_m = 0.0;      ///< r_A: of the moving part about its grip; also its largest lever
  double length_scale = 0.0;  ///< r_A / 50 mm
  double coordinate_m = 0.0;  ///< largest coordinate in W: parts as placed, start pose
  double tolerance_m = 0.0;   ///< of the law: scaled, or the floor
  bool floored = false;       ///< the floor is the larger of the two
  double climb_m = 0.0;       ///< height of a step that does not hold the part; 0: every step does
  double largest_offset_m = 0.0;  ///< largest coordinate that this part allows
  /// 1 / (1 + k_t rho^2 / k_r) at the largest lever rho = r_A: the share of the stiffness k_t that
  /// is left of it in a contact there. 1 at the grip.
  double stiffness_share = 1.0;
};

/// Cost: O(pieces).
ServedSize served_size(const SceneView& scene);

/// Defect, range and fix, or nothing when the proxy law serves this size.
std::string size_refusal(const ServedSize& size);

}  // namespace haptic::tools
