// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A compiled scene with other parameters: another law, other gains, with or without the search at
/// the goal pose.

#include <functional>

#include "rt_core/scene/scene_view.hpp"
#include "tools/common/scene_bytes.hpp"

namespace haptic::tools {

/// The bytes of `scene` with parameters that `change` has changed; capacities, size of the state
/// and hash are made again. `visits`: pairs that a search at the goal pose may visit, 0: as before.
/// `change_body`, where given, changes friction of the bodies.
/// @throws InputError when the scene is refused with them.
[[nodiscard]] SceneBytes changed_scene(const SceneView& scene,
                                       const std::function<void(SceneParameters&)>& change,
                                       std::uint32_t visits = 0,
                                       const std::function<void(BodyRecord&)>& change_body = {});

}  // namespace haptic::tools
