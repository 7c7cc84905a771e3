// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One motion through one scene under two laws: what the hand would feel, where the part is shown,
/// and how far the wrench jumps from tick to tick.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/session/core_session.hpp"

namespace haptic::sim {

/// One tick of one law; vectors in W axes.
struct LawTick {
  double t_s = 0;
  double force_n[3] = {0, 0, 0}, torque_nm[3] = {0, 0, 0};
  double goal_m[3] = {0, 0, 0};   ///< origin of A's mesh frame where the device asks it to be
  double proxy_m[3] = {0, 0, 0};  ///< and where the part is shown; law proxy: free of obstacles
  double proxy_gap_m = 0;
  double d_near_m = 0;
  std::uint32_t flags = 0;
};

/// Change of the wrench from one tick to the next.
struct LawStep {
  std::size_t tick = 0;  ///< at its end
  double force_n = 0, torque_nm = 0;
};

struct LawRun {
  LawId law = LawId::kPaper;
  std::vector<LawTick> ticks;
  std::vector<LawStep> force_steps,
      torque_steps;                            ///< the largest, descending, at most kListedSteps
  double k_t_n_per_m = 0, k_r_nm_per_rad = 0;  ///< of the coupling
  double worst_gap_m = 0;
  double farthest_goal_m = 0, farthest_proxy_m = 0;  ///< along the direction asked for
  double proxy_there_m = 0;   ///< proxy from goal, across that direction, where it is farthest
  double end_distance_m = 0;  ///< proxy to goal in the last tick
};
inline constexpr std::size_t kListedSteps = 8;

/// The same scene with other parameters, which must be of its kind: capacity, size of the core's
/// memory and hash follow. @throws tools::InputError  the parameters are refused.
[[nodiscard]] std::vector<std::byte> scene_with_parameters(const SceneView& view,
                                                           const SceneParameters& changed);

/// The scene with another law and, when > 0, another rotational stiffness of the coupling; all else
/// stays. Cost: a copy. @throws tools::InputError when the stiffness is out of the format's range.
[[nodiscard]] std::vector<std::byte> scene_with_law(const SceneView& view, LawId law,
                                                    double k_r_nm_per_rad = 0);

/// Runs the motion through `scene`; `towards` (of unit length) is the direction in which the part
/// is led into the obstacle. @throws tools::InputError when the scene or a pose is refused.
[[nodiscard]] LawRun run_law(std::span<const std::byte> scene, LawId law,
                             std::span<const MotionSample> motion, const double (&towards)[3]);

/// Both runs side by side, one line per tick.
[[nodiscard]] std::string comparison_csv(std::span<const LawRun> runs);
/// Largest steps, gaps and ways in words and tables.
[[nodiscard]] std::string comparison_page(std::span<const LawRun> runs, const std::string& title);
[[nodiscard]] std::string comparison_json(std::span<const LawRun> runs);
/// Force, torque and distance of the part over time, a curve per law, as a complete SVG document.
[[nodiscard]] std::string comparison_picture(std::span<const LawRun> runs,
                                             const std::string& title);

}  // namespace haptic::sim
