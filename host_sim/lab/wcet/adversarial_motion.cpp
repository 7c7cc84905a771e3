// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/wcet/adversarial_motion.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/lab/wcet/scene_motion.hpp"

namespace haptic::sim {
namespace {

constexpr double kNearKnown = 0.01;  // of A's radius, and rad
constexpr double kPositionDigits = 1e9, kQuaternionDigits = 1e12, kTimeDigits = 1e6;

Vector vector_of(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

Rotation turned(const Rotation& q, const Vector& rotation_rad) {
  const double angle = rotation_rad.norm();
  if (angle == 0) return q;
  return (Rotation(Eigen::AngleAxisd(angle, rotation_rad / angle)) * q).normalized();
}

Vector at_most(const Vector& v, double limit) {
  const double length = v.norm();
  return length > limit ? Vector(v * (limit / length)) : v;
}

double rounded(double value, double digits) { return std::round(value * digits) / digits; }

}  // namespace

MotionSample as_read(const MotionSample& sample) {
  MotionSample read = sample;
  const double* q = sample.q_wxyz;
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& value : read.q_wxyz) value /= length;
  return read;
}

AdversarialSpace::AdversarialSpace(const SceneView& view, std::span<const MotionSample> known)
    : known_(known),
      reference_m_(vector_of(view.bodies()[0].reference_m)),
      radius_m_(moving_radius_m(view)),
      period_s_(1 / view.parameters().rate_hz) {
  low_m_ = high_m_ = reference_m_;
  bool first = true;
  for (const PieceRecord& piece : view.pieces()) {
    if (piece.body == 0) continue;
    const Vector centre =
        vector_of(view.bodies()[piece.body].reference_m) + vector_of(piece.centre_m);
    const Vector reach = Vector::Constant(piece.radius_m);
    low_m_ = first ? Vector(centre - reach) : Vector(low_m_.cwiseMin(centre - reach));
    high_m_ = first ? Vector(centre + reach) : Vector(high_m_.cwiseMax(centre + reach));
    first = false;
  }
}

SegmentVelocity AdversarialSpace::drawn_velocity(Seeded& random) const {
  return {random.uniform(0, kAdversarialSpeed_m_per_s) * random.direction(),
          random.uniform(0, kAdversarialTurn_rad_per_s) * random.direction()};
}

AdversarialMotion AdversarialSpace::drawn(Seeded& random) const {
  AdversarialMotion motion;
  if (random.below(3) < 2) {
    const MotionSample& s = known_[random.below(static_cast<std::uint32_t>(known_.size()))];
    motion.q_wa = turned(Rotation(s.q_wxyz[0], s.q_wxyz[1], s.q_wxyz[2], s.q_wxyz[3]).normalized(),
                         random.uniform(0, kNearKnown) * random.direction());
    motion.p_wr = vector_of(s.p) + motion.q_wa * reference_m_ +
                  random.uniform(0, kNearKnown * radius_m_) * random.direction();
  } else {
    for (int i = 0; i < 3; ++i) motion.p_wr[i] = random.uniform(low_m_[i], high_m_[i]);
    motion.q_wa = random.rotation();
  }
  for (SegmentVelocity& segment : motion.segments) segment = drawn_velocity(random);
  return motion;
}

AdversarialMotion AdversarialSpace::changed(const AdversarialMotion& motion, Seeded& random) const {
  AdversarialMotion other = motion;
  const double share = std::pow(10.0, random.uniform(-6, 0));
  const std::uint32_t what = random.below(5);
  if (what <= 1) other.p_wr += share * radius_m_ * random.direction();
  if (what >= 1 && what <= 2) other.q_wa = turned(other.q_wa, share * random.direction());
  if (what < 3) return other;
  SegmentVelocity& segment = other.segments[random.below(kMotionSegments)];
  if (what == 4) {
    segment = drawn_velocity(random);
    return other;
  }
  segment.v_m_per_s =
      at_most(segment.v_m_per_s + share * kAdversarialSpeed_m_per_s * random.direction(),
              kAdversarialSpeed_m_per_s);
  segment.w_rad_per_s =
      at_most(segment.w_rad_per_s + share * kAdversarialTurn_rad_per_s * random.direction(),
              kAdversarialTurn_rad_per_s);
  return other;
}

std::vector<MotionSample> AdversarialSpace::samples(const AdversarialMotion& motion) const {
  std::vector<MotionSample> list;
  Vector p = motion.p_wr;
  Rotation q = motion.q_wa;
  for (std::size_t tick = 0; tick < kMotionSegments * kSegmentTicks; ++tick) {
    MotionSample sample = sample_at(static_cast<double>(tick) * period_s_, p - q * reference_m_, q);
    sample.t_s = rounded(sample.t_s, kTimeDigits);
    for (double& value : sample.p) value = rounded(value, kPositionDigits);
    for (double& value : sample.q_wxyz) value = rounded(value, kQuaternionDigits);
    list.push_back(sample);
    const SegmentVelocity& segment = motion.segments[tick / kSegmentTicks];
    p += period_s_ * segment.v_m_per_s;
    q = turned(q, period_s_ * segment.w_rad_per_s);
  }
  return list;
}

}  // namespace haptic::sim
