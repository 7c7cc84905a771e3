// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Judges the motion of a log, and finds what is hardly meant so: unit, order of the quaternion,
/// gaps, a start far from the scene's.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/motion_log/motion_log.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic::sim {

struct LogFigures {
  double duration_s = 0, rate_hz = 0;  ///< on the whole
  double longest_gap_s = 0, median_step_s = 0;
  std::size_t gap_line = 0;  ///< after the longest gap
  double farthest_m = 0;     ///< from the origin
  double way_m = 0;          ///< length of the path
  double extent_m = 0;       ///< largest side of the box that the path fills
  double fastest_m_per_s = 0;
  std::size_t fastest_line = 0;
};
/// Figures of the samples of the log, placed or not, at least two.
[[nodiscard]] LogFigures log_figures(const MotionLog& log);

/// The start of the scene by which a motion is judged.
struct SceneStart {
  MotionSample start;     ///< of A's mesh frame
  double grip_m[3] = {};  ///< of the part in its mesh frame
  double radius_m = 0;    ///< of the part about its grip point
  double reach_m = 0;     ///< of the start and all parts about the origin of W
};
[[nodiscard]] SceneStart scene_start(const SceneView& view);

/// How far a pose is from the start.
struct StartDistance {
  double way_m = 0;  ///< of the grip point
  double turn_rad = 0;
};
[[nodiscard]] StartDistance distance_from(const SceneStart& scene, const MotionSample& pose);

/// Warnings for the person, each a sentence with its fix: unit, speed, gaps.
[[nodiscard]] std::vector<std::string> log_warnings(const MotionLog& log, const LogFigures& figures,
                                                    const std::optional<SceneStart>& scene);

/// Where the other order of the quaternion is the likelier one: as read the part starts half a turn
/// from the scene's start (without a scene: most of the motion, from the axes of W), in the other
/// order near it. Nothing else tells them apart: turns between samples are the same angles.
[[nodiscard]] std::optional<std::string> order_warning(const MotionLog& log,
                                                       const std::optional<SceneStart>& scene);

/// Where the first pose is more than a radius of the part, or half a radian, from the start.
[[nodiscard]] std::optional<std::string> start_warning(const SceneStart& scene,
                                                       const MotionSample& first);

/// Farther from the origin than a motion that is played may be.
inline constexpr double kFarthestLog_m = 10;
/// @throws tools::InputError  no core plays it: beyond kFarthestLog_m.
void require_near(const MotionLog& log, const LogFigures& figures);

}  // namespace haptic::sim
