// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the program must be able to do. The general program opens any scene: everything is on. An
/// image is compiled for one scene (linker/IMAGES.md): what the scene lacks is not compiled, and
/// both compute the same bits. The core asks `kSceneTraits` before it asks the scene, so that the
/// compiler drops the branch that no scene of the image can take. A feature has a trait where
/// leaving it out saves several per cent of code, state or instructions; the others are compiled.

#include <cstdint>

#include "rt_core/scene/proxy_limits.hpp"
#include "rt_core/scene/scene_format.hpp"

namespace haptic {

/// Features are `true` where they are compiled; numbers are room. The order is that of the header
/// that the graph compiler writes.
struct SceneTraits {
  bool image = false;  ///< compiled for the one scene whose blob has `content_hash`
  std::uint64_t content_hash = 0;

  LawSet laws = all_laws();  ///< those that are compiled
  bool friction = true;      ///< law proxy: a static body rubs

  bool free_orientation = true;  ///< the part turns; without it the program has no columns for it

  bool facets = true;  ///< a piece may be a facet of a surface

  /// More pairs may be near than law proxy has room for: some take turns, some have no slot.
  bool many_pairs = true;

  bool goal_contact = true;  ///< the contact at the goal pose can be searched
  bool device = true;        ///< passivity observer and estimate of the device's twist
  bool guide = true;         ///< a plan leads the hand

  // Not needed by any scene; an image may be built without.
  bool contact_geometry = true;  ///< HapticCore::contact_geometry
  bool table_checks =
      true;  ///< SceneView::open checks every table, in addition to the content hash

  // Room.
  std::uint32_t qp_rows = kMaxFrictionRows;      ///< of one quadratic program of the proxy
  std::uint32_t valid_visits = kMaxValidVisits;  ///< nodes of one search for valid planes

  /// True if the rotation is locked; known to the compiler where no part turns.
  [[nodiscard]] constexpr bool is_locked(bool locked) const noexcept {
    return !free_orientation || locked;
  }

  /// True if a scene of law `law` has law `id`; known to the compiler where no other is compiled.
  [[nodiscard]] constexpr bool is_law(LawId law, LawId id) const noexcept {
    return has_law(id) && (laws == law_set(id) || law == id);
  }
  [[nodiscard]] constexpr bool has_law(LawId id) const noexcept {
    return (laws & law_set(id)) != 0;
  }
  /// True if the wrench of a scene of law `law` is one of the contacts at the goal pose: of every
  /// law but proxy.
  [[nodiscard]] constexpr bool is_at_goal(LawId law) const noexcept {
    return has_laws_at_goal() && !is_law(law, LawId::kProxy);
  }
  [[nodiscard]] constexpr bool has_laws_at_goal() const noexcept {
    return (laws & ~law_set(LawId::kProxy)) != 0;
  }
};

}  // namespace haptic

#ifdef HAPTIC_SCENE_IMAGE
// Written by `graph_compiler --traits`; defines kSceneTraits.
#include "rt_core/scene/scene_image.hpp"
#else
namespace haptic {
inline constexpr SceneTraits kSceneTraits{};
}  // namespace haptic
#endif
