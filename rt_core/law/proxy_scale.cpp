// SPDX-License-Identifier: Apache-2.0
#include "rt_core/law/proxy_scale.hpp"

#include <algorithm>
#include <limits>

namespace haptic {
namespace {

/// Radius of the part for which the lengths below were chosen.
constexpr Real kChosenFor_m = 0.05_r;

}  // namespace

ProxyScale proxy_scale(Real radius_m, Real extent_m, Real tolerance_m) noexcept {
  const Real share = radius_m / kChosenFor_m;
  const Real floor_m = 64 * kRealEpsilon * (radius_m + extent_m);
  ProxyScale scale;
  scale.tolerance_m = std::max(tolerance_m > 0 ? tolerance_m : 1.0e-7_r * share, floor_m);
  scale.step_m = 2.0e-3_r * share;
  scale.turn_rad = 0.02_r;
  scale.margin_m = 1.0e-4_r * share;
  scale.manifold_m = 2.0e-3_r * share;
  scale.reach_m = scale.step_m + scale.turn_rad * radius_m + scale.margin_m;
  scale.recovery_step_m = 2.0e-4_r * share;
  scale.still_m = std::max(1.0e-9_r * share, floor_m / 64);
  scale.still_rad = scale.still_m / std::max(radius_m, std::numeric_limits<Real>::min());
  return scale;
}

}  // namespace haptic
