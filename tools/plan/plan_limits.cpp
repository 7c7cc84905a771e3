// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/plan_limits.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/common/formatted.hpp"

namespace haptic::tools {

/// Product of the pose's quaternion and that of the middle: the cosine of half the angle, but for
/// its sign.
double PlanLimits::product(const PlanPose& pose) const {
  const double* const q = envelope_.q_wa_xyzw;
  return pose.q_wxyz[0] * q[3] + pose.q_wxyz[1] * q[0] + pose.q_wxyz[2] * q[1] +
         pose.q_wxyz[3] * q[2];
}

double PlanLimits::angle_rad(const PlanPose& pose) const {
  const double* const q = envelope_.q_wa_xyzw;
  const double middle[4] = {q[3], q[0], q[1], q[2]};
  const double sign = product(pose) < 0 ? -1 : 1;
  // From the chord and its complement, so that a small angle keeps its digits.
  double less = 0, more = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const double x = sign * pose.q_wxyz[k];
    less += (x - middle[k]) * (x - middle[k]);
    more += (x + middle[k]) * (x + middle[k]);
  }
  return 4 * std::atan2(std::sqrt(less), std::sqrt(more));
}

bool PlanLimits::hold(const PlanPose& pose) const {
  for (std::size_t k = 0; k < 3 && has_box(); ++k) {
    if (!(pose.x0_m[k] >= envelope_.min_m[k] - kLimitRounding &&
          pose.x0_m[k] <= envelope_.max_m[k] + kLimitRounding)) {
      return false;
    }
  }
  return (envelope_.given & kOrientationGiven) == 0 ||
         angle_rad(pose) <= envelope_.max_angle_rad + kLimitRounding;
}

/// The box is convex. Along a step that turns by at most half a turn, the product with the middle
/// is a part of a cosine's arc no longer than a quarter: where it keeps its sign it is least at an
/// end, and where it does not the part is turned by half a turn on the way.
bool PlanLimits::hold_between(const PlanPose& from, const PlanPose& to) const {
  if ((envelope_.given & kOrientationGiven) == 0 || envelope_.max_angle_rad >= std::numbers::pi) {
    return true;
  }
  double turn = 0;
  for (std::size_t k = 0; k < 4; ++k) turn += from.q_wxyz[k] * to.q_wxyz[k];
  const double last = turn < 0 ? -product(to) : product(to);
  return product(from) * last > 0;
}

std::string PlanLimits::left_by(const PlanPose& pose) const {
  for (std::size_t k = 0; k < 3 && has_box(); ++k) {
    const double x = pose.x0_m[k];
    const bool low = x < envelope_.min_m[k] - kLimitRounding;
    if (!low && x <= envelope_.max_m[k] + kLimitRounding) continue;
    return formatted("the grip point's %c is %.6g m, and [motion_limits] workspace %s is %.6g m",
                     "xyz"[k], x, low ? "min_m" : "max_m",
                     low ? envelope_.min_m[k] : envelope_.max_m[k]);
  }
  if (hold(pose)) return "";
  return formatted(
      "the part is turned by %.6g rad from the middle of [motion_limits] orientation, and its "
      "max_angle_rad is %.6g",
      angle_rad(pose), envelope_.max_angle_rad);
}

std::string PlanLimits::left_by(const Plan& plan) const {
  for (std::size_t k = 0; k < plan.poses.size(); ++k) {
    std::string left = left_by(plan.poses[k]);
    if (left.empty() && k > 0 && !hold_between(plan.poses[k - 1], plan.poses[k])) {
      left =
          "the part turns there through half a turn from the middle of [motion_limits] orientation";
    }
    if (left.empty()) continue;
    return formatted("pose %zu of %zu (from 0) leaves the scene's limits: ", k, plan.poses.size()) +
           left;
  }
  return "";
}

}  // namespace haptic::tools
