// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene, a plan through it, and the plan again as host_sim plan makes it.

#include <string>

#include "rt_core/scene/scene_view.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/plan/plan.hpp"
#include "tools/plan/search/plan_making.hpp"

namespace haptic::sim::test {

inline const std::string kPegGoal = "0,0,-39mm,1,0,0,0";  // of the square peg, in its hole

/// A compiled scene and its view.
struct PlannedScene {
  /// A folder of host_sim/scenes, or a scene file as text.
  explicit PlannedScene(const std::string& folder);
  PlannedScene(const std::string& text, const std::string& name);

  tools::SceneBytes bytes;
  SceneView view;
};

/// Plans from the scene's start to a pose of the mesh frame, as written for --goal.
[[nodiscard]] tools::MadePlan plan_to(const SceneView& view, const std::string& goal,
                                      std::uint64_t seed = 1, double seconds = 60,
                                      const std::string& start = "start");

}  // namespace haptic::sim::test
