// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the core keeps of each pair, besides its gate.

#include <cstdint>

#include "rt_core/contact/contact_region.hpp"
#include "rt_core/contact/feature_bounds.hpp"
#include "rt_core/contact/near_set.hpp"
#include "rt_core/contact/pair_verdict.hpp"
#include "rt_core/scene/scene_traits.hpp"

namespace haptic {

/// What the core keeps of each pair, besides its gate.
struct PairState {
  PairView view;
  FeatureBounds bounds;
  VerdictMemory verdict_memory;
  VerdictResult verdict;
  NearNode best;  ///< node of D_near at the last visit
  Real d_near_m = 0;
  std::uint64_t visited_at = 0;  ///< number of the tick; 0: never
  bool exact = false;
  SceneFlag<&SceneTraits::hidden_nodes> has_hidden;  ///< some of its nodes only separate
  bool bears = true;                                 ///< some node that can carry a force is left
  std::uint32_t near_begin = 0, near_count = 0;      ///< of this tick's visit
  std::uint32_t contact_begin = 0, contact_count = 0;
  ContactSituation situation = ContactSituation::kNone;
};

}  // namespace haptic
