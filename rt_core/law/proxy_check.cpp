// SPDX-License-Identifier: Apache-2.0
// What certifies a step of the proxy: a plane of every near pair that has a gap at its end, and the
// correction of a step that misses one by little.
#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/base/rotation.hpp"
#include "rt_core/law/proxy_step.hpp"

namespace haptic {

/// Largest gap of a pair at q: its certificate's, or that of the best plane of its valid set.
/// Exposed planes come first in the set, so the best of them is known before the rest is measured.
void Proxy::certify(ReachedPair& reached, const GripPose& q, Real least_m,
                    ProxyTick& tick) noexcept {
  const ProxyPair& pair = pairs_[reached.pair];
  const Vec3 y_w = q.x0_w - pair.reference_w;
  constexpr Real kLowest = -std::numeric_limits<Real>::max();
  Real exposed_m = kLowest;
  const auto measure = [&](const PlaneId& id, SupportPair from, bool first) {
    const PlaneGap gap = plane_gap(*pair.view, q.r_wa, y_w, id, from);
    tick.plane_gaps += 1;
    if (!first && (!gap.defined || gap.gap_m <= reached.gap_q_m)) return;
    reached.plane = id;
    reached.support = gap.support;
    reached.gap_q_m = gap.defined ? gap.gap_m : kLowest;
  };
  reached.exact_q = true;
  measure(PlaneId(reached.plane), reached.support, true);
  if (reached.gap_q_m + reached.allowed_m >= least_m) return;
  if (!reached.searched) find_valid(reached, tick);
  PlaneId exposed;
  SupportPair support;
  for (std::uint32_t k = 0; k < reached.valid_count; ++k) {
    const ValidPlane& valid = valid_[reached.valid_begin + k];
    measure(valid.id, valid.support, k == 0);
    if (k + 1 != reached.exposed_count) continue;
    exposed = reached.plane;
    support = reached.support;
    exposed_m = reached.gap_q_m;
  }
  // Any plane certifies; one that only separates is imposed where nothing else is there to be.
  if (exposed_m == kLowest || reached.gap_q_m + reached.allowed_m >= least_m) return;
  reached.plane = exposed;
  reached.support = support;
}

Proxy::Check Proxy::check(const Step& step, Real least_m, ProxyTick& tick) noexcept {
  Check result;
  const Real far = std::sqrt(step.dx_m.squaredNorm());
  const Real turn = std::sqrt(step.dtheta_rad.squaredNorm());
  for (std::uint32_t k = 0; k < reached_.size(); ++k) {
    ReachedPair& reached = reached_[k];
    const ProxyPair& pair = pairs_[reached.pair];
    // The direction of the plane at p, held fixed, loses no more than this.
    const Real least_gap = reached.gap_m - (far + turn * pair.reach_a_m);
    if (least_gap > parameters_.scale.tolerance_m) {
      reached.plane = pair.plane;
      reached.support = pair.support;
      reached.gap_q_m = least_gap;
      reached.exact_q = false;
      continue;
    }
    certify(reached, step.q, least_m, tick);
    const Real lacking = least_m - (reached.gap_q_m + reached.allowed_m);
    if (lacking > 0 && (result.ok || lacking > result.lacking_m)) {
      result = {false, lacking, k};
    }
  }
  return result;
}

/// Displaces a step that is not certified out of what it violates, without turning it.
bool Proxy::correct(Step& step, ProxyTick& tick) noexcept {
  const ProxyScale& scale = parameters_.scale;
  Step trial = step;
  for (std::uint32_t k = 0; k <= kMaxCorrections; ++k) {
    const Check result = check(trial, -scale.tolerance_m, tick);
    if (result.ok) {
      const Real most = scale.step_m + scale.margin_m;
      if (trial.dx_m.squaredNorm() > most * most) return false;
      step = trial;
      return true;
    }
    if (k == kMaxCorrections) break;
    rows_.clear();
    for (const ReachedPair& reached : reached_) {
      if (!reached.exact_q || reached.gap_q_m > scale.step_m) continue;
      const ProxyPair& pair = pairs_[reached.pair];
      const PlaneGap gap =
          plane_gap(*pair.view, trial.q.r_wa, Vec3(trial.q.x0_w - pair.reference_w), reached.plane,
                    reached.support);
      tick.plane_gaps += 1;
      if (!gap.defined) continue;
      QpRow row;
      row.g.head<3>() = gap.normal_w;
      row.h = -gap.gap_m - reached.allowed_m;
      if (!rows_.push(row)) return false;
    }
    const QpResult found = solve_rows(1.0e-4_r * scale.tolerance_m, tick);
    trial = step_by(trial.dx_m + found.z.head<3>(), trial.dtheta_rad);
  }
  return false;
}

}  // namespace haptic
