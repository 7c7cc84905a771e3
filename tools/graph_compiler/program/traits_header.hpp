// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The header that makes an image of a scene: its traits as constants of the core
/// (rt_core/scene/scene_traits.hpp).

#include <string>
#include <vector>

#include "rt_core/scene/scene_traits.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic::tools {

/// Traits of the scene's image: what it needs, and contact_geometry, which no scene asks
/// for; the checks of the tables are the compiler's. `without` leaves some of
/// optional_traits() out, `with` compiles features that the scene does not need. @throws InputError
/// for another name.
SceneTraits image_traits(const SceneView& scene, const std::vector<std::string>& without,
                         const std::vector<std::string>& with);

/// Names that an image may be built without, and all names in the order of the header.
const std::vector<std::string>& optional_traits();
std::vector<std::string> trait_names();

/// Text of `rt_core/scene/scene_image.hpp` of an image. The same bytes for equal input.
std::string traits_header(const SceneTraits& traits, const std::string& scene_name);

}  // namespace haptic::tools
