// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the core keeps of each pair, besides its gate, and how groups of patches share nodes.

#include <array>
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
  Real full_m = 0;               ///< D_near over all nodes, those that only separate too
  std::uint64_t visited_at = 0;  ///< number of the tick; 0: never
  bool exact = false;
  SceneFlag<&SceneTraits::hidden_nodes> has_hidden;  ///< some of its nodes only separate
  bool bears = true;                                 ///< `best` can carry a force
  std::array<FacePlane, 2> of_neighbour{};           ///< as in ContactPatch
  std::uint32_t passed_node = 0;
  SceneFlag<&SceneTraits::hidden_nodes> lends;   ///< apart, but some of its nodes may be near
  Real lent_m = 0;                               ///< D_near by its live nodes, where it lends
  std::uint32_t near_begin = 0, near_count = 0;  ///< of this tick's visit
  std::uint32_t lent_count = 0;                  ///< nodes behind them, as in ContactPatch
  std::uint32_t contact_begin = 0, contact_count = 0;
  ContactSituation situation = ContactSituation::kNone;

  [[nodiscard]] bool is_of_neighbour() const noexcept {
    return has_hidden && (of_neighbour[0].sign != 0 || of_neighbour[1].sign != 0);
  }
};

/// How much of a near node no group has yet, and how much is in the group that is being formed.
struct NodeShare {
  Real left = 1, joining = 0;
  Real nearest = 0;  ///< of the leader: its weight at the leader's depth, however far past an end
};

/// The same of a patch.
struct PatchShare {
  Real left = 1, joining = 0;
  Real past_ends = 0;  ///< how much of what it is nearest to it does not hold
  Real held = 0;       ///< how much of it and the leader is one contact by its near nodes
  bool led = false;    ///< a group of its own has been formed
};

}  // namespace haptic
