// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The guide of a scene from a plan: its stations as the tick reads them (rt_core/tick/guide.hpp),
/// how the part touches at each of them, and the most that the guide can do.

#include "tools/graph_compiler/graph/scene_writer.hpp"
#include "tools/plan/plan.hpp"

namespace haptic::tools {

/// Pull along the way and hold across it [N], ramp [s], and how far from the way the guide lets go,
/// over the length that a turn of 1 rad counts as, where the scene file does not say.
inline constexpr double kDefaultPull_n = 1.0, kDefaultHold_n = 1.0, kDefaultGuideRamp_s = 0.25,
                        kDefaultLetGo = 0.5;

struct GuideGains {
  double pull_n = kDefaultPull_n, hold_n = kDefaultHold_n;
  double let_go_m = 0;  ///< 0: kDefaultLetGo of the plan's length of a turn
  double ramp_s = kDefaultGuideRamp_s;
};

/// The tables of a plan that has been proved for `scene`.
[[nodiscard]] GuideTables guide_tables(const SceneView& scene, const Plan& plan,
                                       const GuideGains& gains = {});

}  // namespace haptic::tools
