// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/peers/geometric_query.hpp"

#include <algorithm>
#include <cmath>

namespace haptic::sim {

GeometricQuery::GeometricQuery(const SceneView& scene)
    : pair_(scene.pair(0)),
      grip_a_(reference_of(scene.bodies()[0])),
      reference_w_(reference_of(scene.bodies()[pair_.b.record->body])),
      epsilon_m_(static_cast<Real>(scene.parameters().epsilon_m)),
      exact_band_m_(scene.parameters().exact_band_m),
      tables_(pair_) {
  reset();
}

void GeometricQuery::reset() {
  tables_.bounds.reset(pair_.marks);
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
  turn_vertices(pair_.a, r_wa, tables_.lanes.data());
  const PairPose pose = make_pair_pose(pair_, tables_.lanes.data(), r_wa, y_w);
  tables_.bounds.advance(odometer_, pose.size_m);
  tables_.near.clear();
  const NearResult found =
      find_near_set(pose, epsilon_m_, tables_.bounds, tables_.scratch, tables_.near);
  const VerdictResult verdict = pair_verdict(pose, found, verdict_);
  gate_ = gate_plane(pose, found, odometer_);
  return verdict.verdict == Verdict::kSeparated
             ? std::max(found.d_near_m, verdict.separation_bound_m)
             : found.d_near_m;
}

}  // namespace haptic::sim
