// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The guide of a scene file from its plan, which is proved again (tools/plan/guide_tables.hpp).

#include <string>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"

namespace haptic::tools {

/// The tables for `scene`, which is the same without a guide. A line for people is added to
/// `notes`.
/// @throws InputError when the plan cannot be read, is of another scene, is not proved or leaves
/// the scene's limits, let_go_m is none, or the law is none with a felt part.
[[nodiscard]] GuideTables make_guide(const SceneGuide& guide, const SceneView& scene,
                                     const std::string& file, std::vector<std::string>& notes);

}  // namespace haptic::tools
