// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the program must be able to do. The general program opens any scene: everything is on. An
/// image is compiled for one scene (linker/IMAGES.md): what the scene lacks is not compiled, and
/// both compute the same bits. The core asks `kSceneTraits` before it asks the scene, so that the
/// compiler drops the branch that no scene of the image can take.

#include <cstdint>

#include "rt_core/scene/proxy_limits.hpp"
#include "rt_core/scene/scene_format.hpp"

namespace haptic {

/// Features are `true` where they are compiled; numbers are room. The order is that of the header
/// that the graph compiler writes.
struct SceneTraits {
  bool image = false;  ///< compiled for the one scene whose blob has `content_hash`
  std::uint64_t content_hash = 0;

  // Laws.
  bool paper = true, weighted_region = true, proxy = true;
  bool friction = true;          ///< law proxy: a static body rubs
  bool coupling_damping = true;  ///< law proxy

  // Pairs and their graphs.
  bool several_pairs = true;
  bool visit_budget = true;                     ///< more pairs than a tick may visit
  bool stored_graphs = true;                    ///< a pair whose graph is stored
  bool formed_graphs = true;                    ///< a pair whose graph is not
  bool narrow_lists = true, wide_lists = true;  ///< neighbors of 16, of 32 bits

  // Basic contacts that some pose can need (scene/node_marks.hpp).
  bool type_a = true, type_b = true, type_c = true;
  bool marked_nodes = true;  ///< a pair of which some are not reachable, or only separate
  bool hidden_nodes = true;  ///< one of which some only separate

  // Orientations.
  bool fixed_orientation = true;  ///< a part that never turns (scene/fixed_planes.hpp)
  bool free_orientation = true;   ///< one that does

  // Watch over the scene's envelope.
  bool orientation_limits = true;  ///< a largest turn
  bool workspace_limits = true;    ///< a box of the grip point

  // Between law and device.
  bool device_turns = true;  ///< the device has six degrees of freedom; false: three, it translates
  bool passivity = true;
  bool device_twist = true;  ///< estimate of the device's twist

  // Not needed by any scene; an image may be built without.
  bool clutch = true;            ///< without it a clutched tick is refused
  bool contact_geometry = true;  ///< HapticCore::contact_geometry
  bool table_checks =
      true;  ///< SceneView::open checks every table, in addition to the content hash

  // Room.
  std::uint32_t qp_rows = kMaxFrictionRows;      ///< of one quadratic program of the proxy
  std::uint32_t valid_visits = kMaxValidVisits;  ///< nodes of one search for valid planes

  /// Whether a part that `never_turns`, or not, is taken for one; known to the compiler where only
  /// one of the two is compiled.
  [[nodiscard]] constexpr bool is_fixed(bool never_turns) const noexcept {
    return fixed_orientation && (!free_orientation || never_turns);
  }

  /// Whether a scene of law `law` has law `id`; known to the compiler where no other is compiled.
  [[nodiscard]] constexpr bool is_law(LawId law, LawId id) const noexcept {
    const bool compiled = id == LawId::kPaper   ? paper
                          : id == LawId::kProxy ? proxy
                                                : weighted_region;
    const int laws = (paper ? 1 : 0) + (weighted_region ? 1 : 0) + (proxy ? 1 : 0);
    return compiled && (laws == 1 || law == id);
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

namespace haptic {

/// A flag that the scene sets; off, and known to the compiler to be, in an image without `feature`.
template <bool SceneTraits::*feature>
struct SceneFlag {
  bool set = false;
  constexpr SceneFlag& operator=(bool value) noexcept {
    set = value;
    return *this;
  }
  constexpr operator bool() const noexcept { return kSceneTraits.*feature && set; }
};

}  // namespace haptic
