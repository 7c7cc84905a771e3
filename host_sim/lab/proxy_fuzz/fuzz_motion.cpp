// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/proxy_fuzz/fuzz_motion.hpp"

#include <algorithm>

namespace haptic::sim {
namespace {

constexpr double kPeriod_s = 1e-3;
constexpr std::uint32_t kLongestRest = 40;

Rotation turned(const Vector& axis, double angle_rad) {
  return Rotation(Eigen::AngleAxisd(angle_rad, axis));
}

}  // namespace

const char* to_text(FuzzMotionKind kind) {
  switch (kind) {
    case FuzzMotionKind::kSlow:
      return "slow";
    case FuzzMotionKind::kFast:
      return "fast";
    case FuzzMotionKind::kJitter:
      return "jitter";
    case FuzzMotionKind::kTeleport:
      return "teleport";
    case FuzzMotionKind::kMixed:
      break;
  }
  return "mixed";
}

FuzzMotion::FuzzMotion(const FuzzScene& scene, FuzzMotionKind kind, const Vector& p,
                       const Rotation& q, std::uint64_t seed)
    : scene_(scene), kind_(kind), now_(kind), random_(seed), p_(p), goal_p_(p), q_(q), goal_q_(q) {}

void FuzzMotion::draw_goal() {
  for (int i = 0; i < 3; ++i) {
    goal_p_[i] = scene_.home[i] + random_.uniform(-scene_.range[i], scene_.range[i]);
  }
  const Vector axis = random_.direction();
  goal_q_ = turned(axis, random_.uniform(-scene_.tilt_rad, scene_.tilt_rad));
  turn_share_ = random_.uniform(0.1, 1.0);
  rest_ = random_.below(3) == 0 ? random_.below(kLongestRest) : 0;
}

/// Goes on towards the present aim, no farther than this.
void FuzzMotion::advance(double linear_m, double angular_rad) {
  const Vector way = goal_p_ - p_;
  const double distance = way.norm();
  const double angle = q_.angularDistance(goal_q_);
  if (distance <= linear_m) {
    p_ = goal_p_;
    if (rest_ > 0) {
      --rest_;
      return;
    }
    draw_goal();
    return;
  }
  p_ += way * (linear_m / distance);
  if (angle > 0) q_ = q_.slerp(std::min(1.0, angular_rad / angle), goal_q_).normalized();
}

Pose FuzzMotion::next() {
  if (kind_ == FuzzMotionKind::kMixed && change_in_-- == 0) {
    now_ = kFuzzMotions[random_.below(4)];
    change_in_ = 20 + random_.below(180);
  }
  const bool fast = now_ == FuzzMotionKind::kFast;
  advance((fast ? 1.0 : 0.1) * kPeriod_s, (fast ? 10.0 : 1.0) * turn_share_ * kPeriod_s);
  const bool jitter = now_ == FuzzMotionKind::kJitter;
  if (!jitter && now_ != FuzzMotionKind::kTeleport) return pose_at(p_, q_);
  const double far_m = jitter ? 1e-3 : 20e-3, turn_rad = jitter ? 0.05 : 1.5;
  Vector shift, turn;
  for (int i = 0; i < 3; ++i) shift[i] = random_.uniform(-far_m, far_m);
  for (int i = 0; i < 3; ++i) turn[i] = random_.uniform(-turn_rad, turn_rad);
  return pose_at(p_ + shift, turned(turn.normalized(), turn.norm()) * q_);
}

}  // namespace haptic::sim
