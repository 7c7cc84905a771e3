// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the core keeps of each pair of pieces and of each static body from tick to tick. Not for
/// inclusion outside rt_core.

#include <array>
#include <cstdint>

#include "rt_core/contact/contact_region.hpp"
#include "rt_core/contact/near_set.hpp"
#include "rt_core/contact/pair_gate.hpp"
#include "rt_core/contact/pair_verdict.hpp"

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
  bool has_hidden = false;                  ///< some of its nodes only separate
  bool bears = true;                        ///< `best` can carry a force
  std::array<FacePlane, 2> of_neighbour{};  ///< as in ContactPatch
  std::uint32_t passed_node = 0;
  Real lent_m = 0;                               ///< apart, but this deep by its live nodes; 0: not
  std::uint32_t near_begin = 0, near_count = 0;  ///< of this tick's visit
  std::uint32_t contact_begin = 0, contact_count = 0;
  ContactSituation situation = ContactSituation::kNone;
};

/// What the gate reads of each pair in every tick: kept apart, so that far pairs cost little.
struct PairGateState {
  GatePlane plane;
  double reach_a_m = 0, reach_b_m = 0;  ///< levers of the odometers
  std::uint32_t body_b = 0;
};

/// A static body's share of the odometers.
struct BodyMotion {
  Vec3 reference_w = Vec3::Zero();
  double swept_m = 0;  ///< sum of the turn times the distance of the grip point from the reference
};

/// A pair that must be looked at, and how near it may be.
struct Candidate {
  double gap_m = 0;
  std::uint32_t pair = 0;
};

}  // namespace haptic
