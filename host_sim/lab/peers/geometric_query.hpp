// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The core's geometric query of one pair without law and wrench: gate, nearest C-faces, verdict.
/// Made of the same functions of rt_core/contact in the order of HapticCore::step, for timing them
/// alone.

#include "host_sim/lab/peers/pair_tables.hpp"
#include "rt_core/base/pose.hpp"
#include "rt_core/contact/near_set.hpp"
#include "rt_core/contact/pair_gate.hpp"
#include "rt_core/contact/pair_verdict.hpp"

namespace haptic::sim {

class GeometricQuery {
 public:
  /// Pair 0 of `scene`, which must outlive the search.
  explicit GeometricQuery(const SceneView& scene);
  GeometricQuery(const GeometricQuery&) = delete;
  GeometricQuery& operator=(const GeometricQuery&) = delete;

  /// One query. Returns D_near, or the gap to a far body [m].
  Real query(const Pose& pose_wa);
  void reset();

 private:
  void advance(const Vec3& x0_w, const Quat& q_wa);

  PairView pair_;
  Vec3 grip_a_, reference_w_;
  Real epsilon_m_;
  double exact_band_m_;
  PairTables tables_;
  VerdictMemory verdict_;
  GatePlane gate_;
  Odometer odometer_;
  Vec3 last_x0_w_ = Vec3::Zero();
  Quat last_q_wa_ = Quat::Identity();
  bool has_last_ = false;
};

}  // namespace haptic::sim
