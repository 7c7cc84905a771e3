// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/displacement_pose.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/base/rotation.hpp"

namespace haptic::hal {
namespace {

/// The setting where it is usable, else its default.
Real within(Real value, Real least, Real most, Real otherwise) noexcept {
  return value >= least && value <= most ? value : otherwise;
}

}  // namespace

DisplacementSettings usable(const DisplacementSettings& wanted) noexcept {
  const DisplacementSettings standard;
  DisplacementSettings s = wanted;
  s.full_speed_m_per_s = within(s.full_speed_m_per_s, 0, 10, standard.full_speed_m_per_s);
  s.full_turn_rad_per_s = within(s.full_turn_rad_per_s, 0, 100, standard.full_turn_rad_per_s);
  s.dead_zone = within(s.dead_zone, 0, 0.9_r, standard.dead_zone);
  s.reach_m = within(s.reach_m, 0, 100, standard.reach_m);
  if (s.longest_step_ns <= 0 || s.longest_step_ns > 1'000'000'000)
    s.longest_step_ns = standard.longest_step_ns;
  return s;
}

void DisplacementPose::reset() noexcept {
  pose_dh_ = Pose{};
  velocity_d_ = Twist{};
  stamp_ns_ = reported_ns_ = 0;
  stamped_ = false;
}

Real DisplacementPose::share_of(double raw, double full_scale) const noexcept {
  const Real share = std::clamp(static_cast<Real>(raw / full_scale), Real{-1}, Real{1});
  const Real beyond = std::abs(share) - settings_.dead_zone;
  return beyond > 0 ? std::copysign(beyond / (1 - settings_.dead_zone), share) : Real{0};
}

void DisplacementPose::advance(std::int64_t stamp_ns) noexcept {
  // Stamps are of one clock, but the difference of any two numbers must not overflow.
  const auto since = [this](std::int64_t to_ns) {
    return to_ns > reported_ns_
               ? static_cast<std::uint64_t>(to_ns) - static_cast<std::uint64_t>(reported_ns_)
               : 0;
  };
  if (stamped_ && stamp_ns > stamp_ns_) {
    const auto longest = static_cast<std::uint64_t>(settings_.longest_step_ns);
    const std::uint64_t lasted = std::min(since(stamp_ns), longest);
    const std::uint64_t done = std::min(since(stamp_ns_), longest);
    const Real dt_s = static_cast<Real>(lasted - done) * 1.0e-9_r;
    pose_dh_.p_wa += velocity_d_.linear_w * dt_s;
    const Real distance_m = pose_dh_.p_wa.norm();
    if (distance_m > settings_.reach_m) pose_dh_.p_wa *= settings_.reach_m / distance_m;
    pose_dh_.q_wa = so3_exp(velocity_d_.angular_w * dt_s) * pose_dh_.q_wa;
    pose_dh_.q_wa.normalize();
    if (since(stamp_ns) >= longest) velocity_d_ = Twist{};
  }
  stamp_ns_ = stamped_ ? std::max(stamp_ns_, stamp_ns) : stamp_ns;
  stamped_ = true;
}

void DisplacementPose::take(const Vec3& push, const Vec3& turn, std::int64_t stamp_ns) noexcept {
  advance(stamp_ns);
  velocity_d_.linear_w = push * settings_.full_speed_m_per_s;
  velocity_d_.angular_w = turn * settings_.full_turn_rad_per_s;
  reported_ns_ = stamp_ns_;
}

}  // namespace haptic::hal
