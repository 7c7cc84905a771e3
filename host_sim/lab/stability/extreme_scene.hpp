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

// D_near and its normal in an extreme scene against the exhaustive search in long double.

/// What was found over the seeded poses of one scene. Depths run from a tenth of the size inside to
/// a tenth outside, most of them within a hundredth.
struct DepthErrors {
  std::uint32_t poses = 0;
  std::uint32_t wrong_verdicts = 0, wrong_depths = 0, wrong_normals = 0, refused_poses = 0;
  double limit_m = 0;  ///< that the scalar of the core is held to (rt_core/METHOD.md section 11)
  double depth_error_m = 0;       ///< largest, beyond what D_near may be
  double normal_shortfall_m = 0;  ///< largest depth that the reported normal loses to the best one
  double normal_angle_rad = 0;    ///< largest angle to the nearest normal that attains D_near
  std::string refusal;            ///< of the scene writer; nothing was measured then

  [[nodiscard]] std::uint32_t failures() const {
    return wrong_verdicts + wrong_depths + wrong_normals + refused_poses;
  }
};

/// Compares `poses` poses, drawn from `seed`, in a core that keeps its history over them: each is a
/// jump. `fault_m` is added to every depth of the core: with one beyond the limit every pose must
/// fail, which shows that the comparison can.
[[nodiscard]] DepthErrors measure_depth(const ExtremeScene& scene, std::uint32_t poses,
                                        std::uint64_t seed, double fault_m = 0);

}  // namespace haptic::sim
