// SPDX-License-Identifier: Apache-2.0
#pragma once
/// From a plan to the guide of a scene: proved again, its stations as the tick reads them, and what
/// the guide can do at the most.

#include <string>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"

namespace haptic::tools {

/// Pull along the way and hold across it [N], ramp [s], and how far from the way the guide lets go,
/// over the length that a turn of 1 rad counts as, where the scene file does not say.
inline constexpr double kDefaultPull_n = 1.0, kDefaultHold_n = 1.0, kDefaultGuideRamp_s = 0.25,
                        kDefaultLetGo = 0.5;

/// The tables for `scene`, which is the same without a guide. A line for people is added to
/// `notes`.
/// @throws InputError when the plan cannot be read, is of another scene or is not proved, or the
/// law is none with a felt part.
[[nodiscard]] GuideTables make_guide(const SceneGuide& guide, const SceneView& scene,
                                     const std::string& file, std::vector<std::string>& notes);

}  // namespace haptic::tools
