// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Loop bounds of a compiled scene as text, for a static analysis of the servo tick: such tools
/// cannot see them in the program, because they are numbers in the scene.

#include <string>

#include "rt_core/scene/scene_view.hpp"

namespace haptic::sim {

/// One line per bound, columns separated by tabs: name, bound, what it bounds. Lines that begin
/// with '#' are comments. Every field of SceneCapacity that is a number is named as in the header,
/// then the bounds that are compiled into the core, and the stack of a tick where the build has
/// measured it. `name`: of the scene, for the first line.
[[nodiscard]] std::string flow_facts(const SceneView& view, const std::string& name);

}  // namespace haptic::sim
