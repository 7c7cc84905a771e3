// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The core's search for the near set, driven without the rest of the core, with its bounds open to
/// the caller.

#include <span>

#include "host_sim/lab/peers/pair_tables.hpp"
#include "rt_core/contact/near_set.hpp"

namespace haptic::sim {

/// Not movable: the tables point into its memory.
class DirectSearch {
 public:
  /// Pair 0 of the scene, which must outlive it. A keeps the orientation `q_wa`.
  DirectSearch(const SceneView& view, const Quat& q_wa);
  DirectSearch(const DirectSearch&) = delete;
  DirectSearch& operator=(const DirectSearch&) = delete;

  /// Moves A's origin to `p_w` in a straight line and searches there.
  NearResult search(const Vec3& p_w);
  /// Near set of the last search.
  [[nodiscard]] std::span<const NearNode> near() const { return tables_.near.view(); }

  /// The stale upper bounds of the pair's faces and edges.
  [[nodiscard]] FeatureBounds& bounds() { return tables_.bounds; }

 private:
  const SceneView& view_;
  PairView pair_;
  Mat3 r_wa_;
  Vec3 grip_w_, reference_w_;
  PairTables tables_;
  Odometer odometer_;
  Vec3 last_p_w_ = Vec3::Zero();
  bool moved_ = false;
};

}  // namespace haptic::sim
