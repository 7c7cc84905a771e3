// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The warning for people who load a scene in which a body is not the solid of its mesh.

#include <string>
#include <vector>

#include "rt_core/scene/scene_view.hpp"

namespace haptic::tools {

/// Sentences, one for each simplified body: its name, distance of the surfaces, of a solid
/// the change of volume.
std::vector<std::string> simplification_texts(const SceneView& view);

/// Says them on standard error, "program: warning: scene: ...": once for each scene in a process.
void tell_simplification(const std::string& program, const std::string& scene,
                         const SceneView& view);

}  // namespace haptic::tools
