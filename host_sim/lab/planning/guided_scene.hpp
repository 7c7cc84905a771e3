// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Scenes whose guide is made for a trial: of a plan in memory, or changed after compiling.

#include <functional>
#include <span>

#include "rt_core/scene/scene_view.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"
#include "tools/plan/plan.hpp"

namespace haptic::sim {

/// The compiled scene. @throws tools::InputError as the compiler does.
[[nodiscard]] tools::SceneBytes compiled_scene(const tools::SceneFile& file);

/// The view of bytes that were just made. @throws tools::InputError  they do not open.
[[nodiscard]] SceneView opened_scene(const tools::SceneBytes& bytes);

/// The compiled scene with the plan as its `[guide]`, defaults else.
/// @throws tools::InputError as the compiler does, also where the plan is not proved.
[[nodiscard]] tools::SceneBytes guided_scene(tools::SceneFile file, const tools::Plan& plan);

/// The scene with another guide, which no compiler need have made; its hash is made again.
/// @throws tools::InputError  the scene is refused then.
using ChangeGuide = std::function<void(GuideRecord&, std::span<GuideStation>)>;
[[nodiscard]] tools::SceneBytes with_changed_guide(const tools::SceneBytes& scene,
                                                   const ChangeGuide& change);

}  // namespace haptic::sim
