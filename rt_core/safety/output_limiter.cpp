// SPDX-License-Identifier: Apache-2.0
#include "rt_core/safety/output_limiter.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/base/stamp.hpp"

namespace haptic {
namespace {

/// Limits are met with this margin, so that rounding in the stages behind stays within them.
constexpr Real kInside = 1.0_r - 16.0_r * kRealEpsilon;

/// Limit of a norm and of the components; a component's 0: the norm's alone.
struct VectorLimit {
  Real norm;
  const Vec3& axis;
};

bool is_within(const Vec3& v, const VectorLimit& limit) noexcept {
  bool within = is_finite(v) && robust_length(v) <= limit.norm * kInside;
  for (int k = 0; k < 3; ++k) {
    within = within && (limit.axis[k] == 0.0_r || std::abs(v[k]) <= limit.axis[k] * kInside);
  }
  return within;
}

/// Any finite `v` scaled down into the limit.
Vec3 shortened(const Vec3& v, const VectorLimit& limit) noexcept {
  const Real largest = v.cwiseAbs().maxCoeff();
  if (!(largest > 0.0_r)) return Vec3::Zero();
  // By its shape: a share of a huge number would have no digits left.
  const Vec3 shape = v / largest;
  Real size = std::min(largest, limit.norm / shape.norm());
  for (int k = 0; k < 3; ++k) {
    if (limit.axis[k] > 0.0_r) size = std::min(size, limit.axis[k] / std::abs(shape[k]));
  }
  return (size * kInside) * shape;
}

/// Largest s in [0, 1] with s spring + damping within the limit; negative where there is none.
Real largest_share(const Vec3& spring, const Vec3& damping, const VectorLimit& limit) noexcept {
  // In numbers of at most one: no square overflows.
  const Real unit =
      std::max({spring.cwiseAbs().maxCoeff(), damping.cwiseAbs().maxCoeff(), limit.norm});
  const Vec3 a = spring / unit, d = damping / unit;
  const Real r = limit.norm / unit;
  Real low = 0.0_r, high = 1.0_r;
  // |d|^2 - r^2 + 2 s a.d + s^2 |a|^2 <= 0
  const Real aa = a.squaredNorm(), ad = a.dot(d), rest = d.squaredNorm() - r * r;
  if (aa > 0.0_r) {
    const Real discriminant = ad * ad - aa * rest;
    if (discriminant < 0.0_r) return -1.0_r;
    const Real root = std::sqrt(discriminant);
    // The form of each root without cancellation.
    low = std::max(low, ad > 0.0_r || rest <= 0.0_r ? (-ad - root) / aa : rest / (root - ad));
    high = std::min(high, ad > 0.0_r ? -rest / (ad + root) : (root - ad) / aa);
  } else if (rest > 0.0_r) {
    return -1.0_r;
  }
  for (int k = 0; k < 3; ++k) {
    const Real axis = limit.axis[k];
    if (axis == 0.0_r) continue;
    if (spring[k] == 0.0_r) {
      if (std::abs(damping[k]) > axis) return -1.0_r;
      continue;
    }
    const Real one = (-axis - damping[k]) / spring[k], other = (axis - damping[k]) / spring[k];
    low = std::max(low, std::min(one, other));
    high = std::min(high, std::max(one, other));
  }
  return low <= high ? high : -1.0_r;
}

/// spring + damping within the limit: first the spring is taken back, then the damping.
Vec3 clamped_sum(const Vec3& spring, const Vec3& damping, const VectorLimit& limit,
                 std::uint32_t& flags) noexcept {
  Vec3 sum = spring + damping;
  if (is_within(sum, limit)) return sum;
  flags |= kLimiterClamped;
  const Real share = largest_share(spring, damping, limit);
  if (share < 0.0_r) {
    flags |= kLimiterDampingCut;
    return shortened(damping, limit);
  }
  const Vec3 cut = share * spring + damping;
  return is_finite(cut) ? shortened(cut, limit) : Vec3(Vec3::Zero());
}

/// 1 up to `full`, 0 from `zero` on.
Real fade(Real speed, Real full, Real zero) noexcept {
  if (speed <= full) return 1.0_r;
  return speed < zero ? (zero - speed) / (zero - full) : 0.0_r;
}

Real speed_share(const Twist& twist, const SafetyLimits& l) noexcept {
  if (!is_finite(twist)) return 0.0_r;
  return std::min(
      fade(robust_length(twist.linear_w), l.full_speed_m_per_s, l.zero_speed_m_per_s),
      fade(robust_length(twist.angular_w), l.full_turn_rad_per_s, l.zero_turn_rad_per_s));
}

void drop_axes(Wrench& wrench, std::uint32_t driven_dof) noexcept {
  for (int k = 0; k < 3; ++k) {
    if ((driven_dof >> k & 1u) == 0) wrench.force_w[k] = 0.0_r;
    if ((driven_dof >> (k + 3) & 1u) == 0) wrench.torque_w[k] = 0.0_r;
  }
}

Wrench scaled(const Wrench& wrench, Real share) noexcept {
  return {share * wrench.force_w, share * wrench.torque_w};
}

/// From `last` towards `target` by at most `allowed`; arrives exactly.
Vec3 stepped(const Vec3& last, const Vec3& target, Real allowed, std::uint32_t& flags) noexcept {
  const Vec3 way = target - last;
  const Real length = robust_length(way);
  if (length <= allowed) return target;
  flags |= kLimiterSlewed;
  return last + way * (allowed / length);
}

}  // namespace

OutputLimiter::OutputLimiter(const SafetyLimits& limits) noexcept { limit(limits); }

void OutputLimiter::limit(const SafetyLimits& limits) noexcept {
  limits_ = usable(limits);
  WrenchRampLimits ramp;
  ramp.slew_n_per_s = limits_.slew_n_per_s;
  ramp.slew_nm_per_s = limits_.slew_nm_per_s;
  ramp.ramp_in_s = limits_.ramp_in_s;
  ramp_ = WrenchRamp(ramp);
  reset();
}

void OutputLimiter::reset() noexcept {
  ramp_.reset(false);
  last_ = last_finite_spring_ = last_finite_damping_ = Wrench{};
  stamped_ = false;
  stamp_ns_ = 0;
}

/// The rendered wrench of this tick, as far as the device may feel it.
Wrench OutputLimiter::clamped(const LimiterInput& input, std::uint32_t& flags) noexcept {
  if (is_finite(input.spring_d) && is_finite(input.damping_d)) {
    last_finite_spring_ = input.spring_d;
    last_finite_damping_ = input.damping_d;
  } else {
    flags |= kLimiterNotFinite;
  }
  const Real share = speed_share(input.twist_d, limits_);
  if (share < 1.0_r) flags |= kLimiterSpeed;
  Wrench spring = scaled(last_finite_spring_, share);
  Wrench damping = scaled(last_finite_damping_, share);
  drop_axes(spring, limits_.driven_dof);
  drop_axes(damping, limits_.driven_dof);
  const VectorLimit force = {limits_.max_force_n, limits_.max_axis_force_n};
  const VectorLimit torque = {limits_.max_torque_nm, limits_.max_axis_torque_nm};
  return {clamped_sum(spring.force_w, damping.force_w, force, flags),
          clamped_sum(spring.torque_w, damping.torque_w, torque, flags)};
}

LimitedOutput OutputLimiter::update(const LimiterInput& input) noexcept {
  LimitedOutput out;
  Wrench target = clamped(input, out.flags);
  if (input.wants_force) {
    ramp_.ramp_in();
    const RampedWrench ramped = ramp_.update(input.stamp_ns, target);
    target = ramped.wrench_w;
    out.gain = ramped.gain;
    if (input.late_periods > limits_.held_periods) {
      target = scaled(last_, limits_.decay_per_period);
      out.flags |= kLimiterDecaying;
    }
  } else {
    ramp_.reset(false);
    target = Wrench{};
  }
  if (out.gain < 1.0_r) out.flags |= kLimiterRamping;
  if (input.late_periods > 0 && input.late_periods <= limits_.held_periods) {
    out.flags |= kLimiterLate;
  }

  const Real elapsed_s = stamped_ ? seconds_between(stamp_ns_, input.stamp_ns) : 0.0_r;
  const Real counted_s = std::min(elapsed_s, longest_step_s(limits_.period_ns));
  stamped_ = true;
  stamp_ns_ = input.stamp_ns;
  const Real force_step_n = limits_.slew_n_per_s * counted_s * kInside;
  const Real torque_step_nm = limits_.slew_nm_per_s * counted_s * kInside;
  out.wrench_d = {stepped(last_.force_w, target.force_w, force_step_n, out.flags),
                  stepped(last_.torque_w, target.torque_w, torque_step_nm, out.flags)};
  last_ = out.wrench_d;
  return out;
}

}  // namespace haptic
