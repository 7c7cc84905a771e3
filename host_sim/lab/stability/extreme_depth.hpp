// SPDX-License-Identifier: Apache-2.0
#pragma once
/// D_near and its normal in an extreme scene against the exhaustive search in long double.

#include <cstdint>
#include <string>

#include "host_sim/lab/stability/extreme_scene.hpp"

namespace haptic::sim {

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
