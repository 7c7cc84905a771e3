// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a search at the goal pose found out about one pair.

#include <array>
#include <cstdint>
#include <span>

#include "rt_core/base/step_flags.hpp"
#include "rt_core/contact/contact_situation.hpp"
#include "rt_core/tracking/near_set.hpp"
#include "rt_core/tracking/pair_verdict.hpp"

namespace haptic {

/// What the last tick found out about one pair at the goal pose, for reports, checks and pictures.
/// Spans hold until the next tick.
struct PairReport {
  bool searched = false;  ///< as StepResult::has_goal_contact; else the fields below say nothing
  Verdict verdict = Verdict::kUndecided;
  /// Separated: direction in which the gap is positive. Else: outward normal of the nearest C-face.
  Vec3 normal_w = Vec3::Zero();
  Real separation_bound_m = 0;  ///< separated: gap along normal_w, lower bound of the distance
  Real thickness_m = 0;         ///< touching, undecided: x is that close to the boundary
  /// Colliding: x lies in the tetrahedron of c = mean(B) - R mean(A) and the points b_k - R a_k.
  std::array<SupportPair, 3> portal;
  /// As in StepResult; exact where `exact`; else a lower bound: apart, of the distance; colliding,
  /// of D_near over all nodes.
  Real d_near_m = kNotSearched;
  bool exact = false;  ///< D_near and near set are those of this pose
  bool visited = false;
  std::uint32_t best_node = 0;  ///< node of D_near, when exact
  /// Near set, in no particular order; empty unless exact.
  std::span<const NearNode> near;
  std::span<const std::uint32_t> contact_nodes;  ///< those with their point in both features
  ContactSituation situation = ContactSituation::kNone;
};

}  // namespace haptic
