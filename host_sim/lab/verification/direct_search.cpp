// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/verification/direct_search.hpp"

namespace haptic::sim {

DirectSearch::DirectSearch(const SceneView& view, const Quat& q_wa)
    : view_(view),
      pair_(view.pair(0)),
      r_wa_(q_wa.normalized().toRotationMatrix()),
      grip_w_(r_wa_ * reference_of(view.bodies()[0])),
      reference_w_(reference_of(view.bodies()[1])),
      tables_(pair_) {
  turn_vertices(pair_.a, r_wa_, tables_.lanes.data());
}

NearResult DirectSearch::search(const Vec3& p_w) {
  if (moved_) {
    const double step = static_cast<double>((p_w - last_p_w_).norm());
    odometer_.of_a += step;
    odometer_.of_b += step;
  }
  last_p_w_ = p_w;
  moved_ = true;
  const PairPose pose =
      make_pair_pose(pair_, tables_.lanes.data(), r_wa_, (p_w + grip_w_) - reference_w_);
  tables_.bounds.advance(odometer_, pose.size_m);
  tables_.near.clear();
  return find_near_set(pose, static_cast<Real>(view_.parameters().epsilon_m), tables_.bounds,
                       tables_.scratch, tables_.near);
}

}  // namespace haptic::sim
