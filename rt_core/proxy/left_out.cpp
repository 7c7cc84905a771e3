// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/left_out.hpp"

#include <algorithm>
#include <cmath>

namespace haptic {
namespace {

/// Roundings of what a motion takes, in those of the whole motion.
constexpr Real kTakenRounding = 16;

}  // namespace

Real taken_m(const LeftOut& left, const Vec3& dx_m, const Vec3& dtheta_rad) noexcept {
  const Real far = std::sqrt(dx_m.squaredNorm());
  const Real turn = std::sqrt(dtheta_rad.squaredNorm());
  const Real by_reach_m = left.reach_m * (std::sqrt(left.normal_w.cross(dtheta_rad).squaredNorm()) +
                                          std::sqrt(left.spread.squaredNorm()) * turn);
  const Real by_moment_m =
      left.moment_spread_m.dot(dtheta_rad.cwiseAbs()) - left.moment_m.dot(dtheta_rad);
  return left.spread.dot(dx_m.cwiseAbs()) - left.normal_w.dot(dx_m) +
         std::min(by_reach_m, by_moment_m) + left.reach_m * kTurnBend * turn * turn +
         kTakenRounding * kRealEpsilon * (far + left.reach_m * turn + std::abs(left.gap_m));
}

void follow(LeftOut& left, const Vec3& dx_m, const Vec3& dtheta_rad) noexcept {
  left.gap_m -= taken_m(left, dx_m, dtheta_rad);
  const Real turn = std::sqrt(dtheta_rad.squaredNorm());
  left.moment_spread_m += Vec3::Constant(left.reach_m * turn * (1 + 4 * kRealEpsilon));
}

LeftOut joined(const LeftOut& left, const LeftOut& other) noexcept {
  const auto join = [](const Vec3& a, const Vec3& a_spread, const Vec3& b, const Vec3& b_spread,
                       Real size, Vec3& middle, Vec3& spread) {
    const Vec3 low = (a - a_spread).cwiseMin(b - b_spread);
    const Vec3 high = (a + a_spread).cwiseMax(b + b_spread);
    middle = (low + high) / 2;
    spread = (high - low) / 2 + Vec3::Constant(4 * kRealEpsilon * size);
  };
  LeftOut both;
  both.reach_m = std::max(left.reach_m, other.reach_m);
  both.gap_m = std::min(left.gap_m, other.gap_m);
  join(left.normal_w, left.spread, other.normal_w, other.spread, 1, both.normal_w, both.spread);
  join(left.moment_m, left.moment_spread_m, other.moment_m, other.moment_spread_m, both.reach_m,
       both.moment_m, both.moment_spread_m);
  return both;
}

}  // namespace haptic
