// SPDX-License-Identifier: Apache-2.0
#include "host_sim/peers/geometric_query.hpp"

#include <algorithm>
#include <cmath>

namespace haptic::sim {
namespace {

Vec3 vector_of(const double (&v)[3]) {
  return {static_cast<Real>(v[0]), static_cast<Real>(v[1]), static_cast<Real>(v[2])};
}

}  // namespace

GeometricQuery::GeometricQuery(const SceneView& scene)
    : pair_(scene.pair(0)),
      grip_a_(vector_of(scene.bodies()[0].reference_m)),
      reference_w_(vector_of(scene.bodies()[pair_.b.record->body].reference_m)),
      epsilon_m_(static_cast<Real>(scene.parameters().epsilon_m)),
      exact_band_m_(scene.parameters().exact_band_m),
      lanes_(3 * std::size_t{pair_.a.lane_count}) {
  NearScratch::Size size;
  size.fit(*pair_.a.record, *pair_.b.record);
  const auto lay_out = [&](Arena& arena) {
    bounds_.place(arena, *pair_.a.record, *pair_.b.record);
    scratch_.place(arena, size);
    near_ = BoundedList<NearNode>(arena.take<NearNode>(pair_.record->near_capacity));
  };
  Arena counting;
  lay_out(counting);
  memory_.resize(counting.used() + 64);
  const auto address = reinterpret_cast<std::uintptr_t>(memory_.data());
  Arena arena(memory_.data() + (64 - address % 64) % 64);
  lay_out(arena);
  reset();
}

void GeometricQuery::reset() {
  bounds_.reset(pair_.marks);
  verdict_ = VerdictMemory{};
  gate_ = GatePlane{};
  odometer_ = Odometer{};
  has_last_ = false;
}

void GeometricQuery::advance(const Vec3& x0_w, const Quat& q_wa) {
  if (has_last_) {
    const double step = static_cast<double>((x0_w - last_x0_w_).norm());
    const Real minus = (q_wa.coeffs() - last_q_wa_.coeffs()).squaredNorm();
    const Real plus = (q_wa.coeffs() + last_q_wa_.coeffs()).squaredNorm();
    const double turn = 2 * static_cast<double>(std::sqrt(std::min(minus, plus)));
    constexpr double kUp = 1 + 64 * static_cast<double>(kRealEpsilon);
    const double lever = static_cast<double>((last_x0_w_ - reference_w_).norm()) + step;
    odometer_.of_a += kUp * (step + turn * (lever + pair_.b.record->reach_m));
    odometer_.of_b += kUp * (step + turn * pair_.a.record->reach_m);
  }
  last_x0_w_ = x0_w;
  last_q_wa_ = q_wa;
  has_last_ = true;
}

Real GeometricQuery::query(const Pose& pose_wa) {
  const Quat q_wa = pose_wa.q_wa.normalized();
  const Mat3 r_wa = q_wa.toRotationMatrix();
  const Vec3 x0_w = pose_wa.p_wa + r_wa * grip_a_;
  const Vec3 y_w = x0_w - reference_w_;
  advance(x0_w, q_wa);
  double gap = gate_.gap_m(odometer_);
  if (!gate_.known || (!is_far(gap, gate_.face, exact_band_m_) &&
                       renew_gate(pair_, r_wa, y_w, odometer_, exact_band_m_, gate_))) {
    gap = gate_.gap_m(odometer_);
  }
  if (gate_.known && is_far(gap, gate_.face, exact_band_m_)) return static_cast<Real>(gap);
  turn_vertices(pair_.a, r_wa, lanes_.data());
  const PairPose pose = make_pair_pose(pair_, lanes_.data(), r_wa, y_w);
  bounds_.advance(odometer_, pose.size_m);
  near_.clear();
  const NearResult found = find_near_set(pose, epsilon_m_, bounds_, scratch_, near_);
  const VerdictResult verdict = pair_verdict(pose, found, verdict_);
  gate_ = gate_plane(pose, found, odometer_);
  return verdict.verdict == Verdict::kSeparated
             ? std::max(found.d_near_m, verdict.separation_bound_m)
             : found.d_near_m;
}

}  // namespace haptic::sim
