// SPDX-License-Identifier: Apache-2.0
#include "host_sim/verification/direct_search.hpp"

namespace haptic::sim {
namespace {

Vec3 vector_of(const double (&v)[3]) {
  return {static_cast<Real>(v[0]), static_cast<Real>(v[1]), static_cast<Real>(v[2])};
}

}  // namespace

DirectSearch::DirectSearch(const SceneView& view, const Quat& q_wa)
    : view_(view),
      pair_(view.pair(0)),
      r_wa_(q_wa.normalized().toRotationMatrix()),
      grip_w_(r_wa_ * vector_of(view.bodies()[0].reference_m)),
      reference_w_(vector_of(view.bodies()[1].reference_m)),
      lanes_(3 * std::size_t{pair_.a.lane_count}) {
  NearScratch::Size size;
  size.fit(*pair_.a.record, *pair_.b.record);
  const auto place = [&](Arena& arena) {
    bounds.place(arena, *pair_.a.record, *pair_.b.record);
    scratch_.place(arena, size);
    near_ = BoundedList<NearNode>(arena.take<NearNode>(pair_.record->near_capacity));
  };
  Arena counting;
  place(counting);
  memory_ = AlignedBytes(counting.used());
  Arena arena(memory_.bytes().data());
  place(arena);
  bounds.reset(pair_.marks);
  turn_vertices(pair_.a, r_wa_, lanes_.data());
}

NearResult DirectSearch::search(const Vec3& p_w) {
  if (moved_) {
    const double step = static_cast<double>((p_w - last_p_w_).norm());
    odometer_.of_a += step;
    odometer_.of_b += step;
  }
  last_p_w_ = p_w;
  moved_ = true;
  const PairPose pose = make_pair_pose(pair_, lanes_.data(), r_wa_, (p_w + grip_w_) - reference_w_);
  bounds.advance(odometer_, pose.size_m);
  near_.clear();
  return find_near_set(pose, static_cast<Real>(view_.parameters().epsilon_m), bounds, scratch_,
                       near_);
}

}  // namespace haptic::sim
