// SPDX-License-Identifier: Apache-2.0
#include "host_sim/shapes/coherent_path.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace haptic::sim {
namespace {

constexpr double kPeriod_s = 1e-3;
constexpr double kLeastGap_m = -0.006, kLargestGap_m = 0.050;
constexpr double kFollow_per_s = 60.0;  // how fast the hand goes after the wanted gap
constexpr double kSmoothing = 0.1;      // of the velocity, per tick: 10 ms

}  // namespace

CoherentPath::CoherentPath(const SceneView& view, const PathSpeed& speed, std::uint64_t seed)
    : speed_(speed) {
  Seeded random(seed);
  for (auto* waves : {&linear_, &angular_}) {
    for (auto& axis : *waves) {
      for (Wave& wave : axis)
        wave = {random.uniform(0.2, 2.0), random.uniform(0.0, 2 * std::numbers::pi)};
    }
  }
  for (Wave& wave : gap_)
    wave = {random.uniform(0.3, 2.5), random.uniform(0.0, 2 * std::numbers::pi)};
  const PairView pair = view.pair(0);
  const double* reference = view.bodies()[pair.b.record->body].reference_m;
  const double *a = pair.a.record->centre_m, *b = pair.b.record->centre_m;
  centre_w_ = Vector(reference[0] + b[0], reference[1] + b[1], reference[2] + b[2]);
  centre_a_ = Vector(a[0], a[1], a[2]);
  q_ = random.rotation();
  const double reach = pair.a.record->radius_m + pair.b.record->radius_m + 0.03;
  x_ = centre_w_ + reach * random.direction() - q_ * centre_a_;
}

Vector CoherentPath::wander(const Wave (&waves)[3][3]) const {
  Vector sum = Vector::Zero();
  for (int i = 0; i < 3; ++i) {
    for (const Wave& wave : waves[i])
      sum[i] += std::sin(2 * std::numbers::pi * wave.frequency_hz * t_s_ + wave.phase);
  }
  const double length = sum.norm();
  return length > 1e-6 ? Vector(sum / length) : Vector(Vector::UnitX());
}

Pose CoherentPath::next(double d_near_m) {
  if (!started_) {
    started_ = true;
    return pose_at(x_, q_);
  }
  double swing = 0;
  for (const Wave& wave : gap_)
    swing += std::sin(2 * std::numbers::pi * wave.frequency_hz * t_s_ + wave.phase) / 3;
  const double middle = 0.5 * (kLeastGap_m + kLargestGap_m);
  // More of the time near contact: the swing is squared towards its lower end.
  const double share = (swing + 1) * (swing + 1) / 4;
  const double wanted = kLeastGap_m + share * 2 * (middle - kLeastGap_m);
  const Vector outward = (x_ + q_ * centre_a_ - centre_w_).normalized();
  const double limit = 0.9 * speed_.linear_m_per_s;
  const double radial = std::clamp(kFollow_per_s * (wanted - d_near_m), -limit, limit);
  Vector along = wander(linear_);
  along -= outward * outward.dot(along);
  const double rest = std::sqrt(speed_.linear_m_per_s * speed_.linear_m_per_s - radial * radial);
  const Vector target = radial * outward + rest * along.normalized();
  velocity_ += kSmoothing * (target - velocity_);
  x_ += kPeriod_s * velocity_;
  const Vector axis = wander(angular_);
  q_ = (Rotation(Eigen::AngleAxisd(kPeriod_s * speed_.angular_rad_per_s, axis)) * q_).normalized();
  t_s_ += kPeriod_s;
  return pose_at(x_, q_);
}

}  // namespace haptic::sim
