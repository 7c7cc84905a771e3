// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/axis_motion.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/device/matrix_exponential.hpp"

namespace haptic::sim {
namespace {

/// Part of a radian of the axis' own oscillation within which the velocity has one extremum.
constexpr double kSubstep_rad = 0.5;
constexpr int kBisections = 60;

/// The time in [low, high] at which `positive`, true at `low` and false at `high`, changes.
template <typename Predicate>
double change_between(double low, double high, const Predicate& positive) {
  for (int k = 0; k < kBisections; ++k) {
    const double middle = 0.5 * (low + high);
    (positive(middle) ? low : high) = middle;
  }
  return high;
}

}  // namespace

AxisMotion::AxisMotion(const AxisParameters& parameters, double period_s)
    : parameters_(parameters), period_s_(period_s), rate_(Eigen::Matrix4d::Zero()) {
  const AxisParameters& p = parameters_;
  rate_(0, 1) = 1.0;
  rate_(1, 0) = -p.hand_stiffness / p.inertia;
  rate_(1, 1) = -(p.damping + p.hand_damping) / p.inertia;
  rate_(1, 2) = 1.0 / p.inertia;
  rate_(2, 3) = 1.0;
  step_ = matrix_exponential<Eigen::Matrix4d>(rate_ * period_s);
  const double own_rad_per_s = std::sqrt(p.hand_stiffness / p.inertia);
  substep_s_ = period_s / std::max(1.0, std::ceil(own_rad_per_s * period_s / kSubstep_rad));
}

AxisMotion::Extended AxisMotion::after(const Extended& from, double time_s) const {
  return matrix_exponential<Eigen::Matrix4d>(rate_ * time_s) * from;
}

double AxisMotion::acceleration(const Extended& z) const { return rate_.row(1).dot(z); }

/// Moving in `direction` from `from`: the first time in (0, span_s] at which the velocity vanishes;
/// negative when there is none. Within a span the velocity has one extremum at most.
double AxisMotion::rest_within(const Extended& from, double direction, double span_s) const {
  const auto moving = [&](double t) { return direction * after(from, t)[1] > 0; };
  const auto first = [&](double end) {
    // From rest the velocity is zero at the very beginning; look from where it has a sign.
    double begin = 0;
    if (from[1] == 0) {
      begin = end;
      while (!moving(begin) && begin > 1e-6 * end) begin *= 0.5;
    }
    return change_between(begin, end, moving);
  };
  const Extended end = after(from, span_s);
  if (direction * end[1] <= 0) return first(span_s);
  const bool dips = direction * acceleration(from) < 0 && direction * acceleration(end) > 0;
  if (!dips) return -1;
  const double lowest = change_between(
      0, span_s, [&](double t) { return direction * acceleration(after(from, t)) < 0; });
  return moving(lowest) ? -1 : first(lowest);
}

double AxisMotion::time_to_rest(const Extended& from, double direction, double limit_s) const {
  Extended at = from;
  for (double gone = 0; gone < limit_s; gone += substep_s_) {
    const double span = std::min(substep_s_, limit_s - gone);
    const double rest = rest_within(at, direction, span);
    if (rest >= 0) return gone + rest;
    at = after(at, span);
  }
  return -1;
}

AxisState AxisMotion::advance(const AxisState& state, const AxisDrive& drive) const {
  const AxisParameters& p = parameters_;
  Extended z(state.position, state.velocity,
             drive.force + p.hand_stiffness * drive.target + p.hand_damping * drive.target_velocity,
             p.hand_stiffness * drive.target_velocity);
  if (p.coulomb == 0) {
    const Extended end = step_ * z;
    return {end[0], end[1]};
  }
  double left_s = period_s_;
  for (int event = 0; event < kMaxEvents && left_s > 0; ++event) {
    double direction = z[1] > 0 ? 1.0 : -1.0;
    if (z[1] == 0) {
      const double pull = z[2] - p.hand_stiffness * z[0];
      direction = pull > 0 ? 1.0 : -1.0;
      if (std::abs(pull) <= p.coulomb) {  // held: until the moving hand has pulled it loose
        if (z[3] == 0) return {z[0], 0};
        direction = z[3] > 0 ? 1.0 : -1.0;
        const double loose_s = (direction * p.coulomb - pull) / z[3];
        if (loose_s >= left_s) return {z[0], 0};
        z[2] += z[3] * loose_s;
        left_s -= loose_s;
      }
    }
    Extended sliding = z;
    sliding[2] -= direction * p.coulomb;
    const double rest_s = time_to_rest(sliding, direction, left_s);
    const double slide_s = rest_s < 0 ? left_s : rest_s;
    z = slide_s == period_s_ ? Extended(step_ * sliding) : after(sliding, slide_s);
    z[2] += direction * p.coulomb;
    if (rest_s < 0) return {z[0], z[1]};
    z[1] = 0;
    left_s -= slide_s;
  }
  return {z[0], left_s > 0 ? 0.0 : z[1]};
}

}  // namespace haptic::sim
