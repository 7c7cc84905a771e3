// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a scene needs of the program, as traits: the graph compiler writes an image's header from
/// them, and SceneView::open of an image compares them with what was compiled. One place for each
/// formula.

#include "rt_core/scene/scene_traits.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic {

/// Traits that this scene's image must have at least; `image` is set. What no scene asks for
/// (SceneTraits::contact_geometry and after) is off. Cost: O(bodies + pairs).
[[nodiscard]] SceneTraits needs_of(const SceneView& scene) noexcept;

/// True if a program compiled with `compiled` can run a scene that needs `needed`: every feature
/// and all the room, and in an image the very blob.
[[nodiscard]] bool covers(const SceneTraits& compiled, const SceneTraits& needed) noexcept;

}  // namespace haptic
