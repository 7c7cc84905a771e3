// SPDX-License-Identifier: Apache-2.0
#pragma once
/// `[motion_limits]` of a scene file: how fast the hand moves, and where it takes the part.

#include "tools/common/toml_table.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"

namespace haptic::tools {

/// Reads speeds (both or neither), `orientation` and `workspace` of the scene, whose start pose has
/// been read. Nothing changes where the table is absent.
/// @throws InputError "file:line:column: defect; fix".
void read_motion_table(const TomlTable& top, SceneFile& scene);

}  // namespace haptic::tools
