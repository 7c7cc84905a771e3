// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A pose of the moving part as a person writes it.

#include <string>

#include "rt_core/base/pose.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic::tools {

/// The pose that a person gives: "start", or three numbers for the place of the moving part's file
/// frame with the scene's start orientation, or seven, x,y,z,qw,qx,qy,qz as in a motion. Lengths
/// in metres, or with mm or um behind the number. The quaternion need not be a unit.
/// @throws UsageError naming what is wrong with the text
[[nodiscard]] Pose pose_from_text(const SceneView& view, const std::string& option,
                                  const std::string& text);

}  // namespace haptic::tools
