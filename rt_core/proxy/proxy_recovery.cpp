// SPDX-License-Identifier: Apache-2.0
// How a proxy that starts inside an obstacle is led out of it.
//
// The nearest face of a piece is often a seam: behind it lies the next piece, and two pieces that
// push the part out over their common seam hold it there for ever. So the way out is one for all
// pieces: straight along a direction n, as far as it takes until every pair is apart. Some way
// along n any pair is apart along n itself, and stays so from there on; before that, it may be
// along the plane that it has. A seam's normal leads into the piece behind it, its way is long, and
// it loses.
#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {
namespace {

constexpr Real kEndless = std::numeric_limits<Real>::max();
/// A way out of several pairs at once is taken where it is no longer than so many of their depths,
/// for so many passes: no planes that contradict each other hold the part for ever.
constexpr Real kFewDepths = 4;
constexpr std::uint32_t kMostShortWays = 256;

}  // namespace

/// How far p has to go along a direction until every listed pair is apart, as far as the budget
/// tells; at least `least_m`, and from `most_m` on no matter how much farther.
Real Proxy::way_out_m(const Vec3& along_w, Real least_m, Real most_m, ProxyTick& tick) noexcept {
  const Real free_m = -parameters_.scale.tolerance_m / 2;
  Real way_m = least_m;
  // What keeps a pair apart now may not farther on.
  for (bool longer = true; longer && way_m < most_m;) {
    longer = false;
    for (const std::uint32_t slot : near_.list.slots()) {
      ProxyPair& pair = near_.pairs[slot];
      if (!pair.inside && clear_m(pair) > way_m) continue;
      if (!has_budget(tick)) return way_m;
      need_view(pair, tick);
      if (!pair.known && !measure(pair, tick)) return way_m;
      const PairAt at = pair_at(pair, part_.pose);
      if (pair.known) {
        const PlaneGap held = plane_gap(at, pair.plane, pair.support);
        tick.work.plane_gaps += 1;
        if (held.defined && held.gap_m + way_m * held.normal_w.dot(along_w) >= free_m) continue;
      }
      tick.work.plane_gaps += 2;
      const Real own_m = free_m - direction_gap(at, along_w, pair.support).gap_m;
      if (!(own_m > way_m)) continue;
      way_m = own_m;
      longer = true;
    }
  }
  return way_m;
}

/// The shortest translation after which every reached pair is apart along the plane that it has
/// now, as a part lies in a corner that it was put into too deep; zero where these planes
/// contradict each other, as those of a seam do, or it is far.
Vec3 Proxy::short_way_out(ProxyTick& tick) noexcept {
  if (out_.short_ways == kMostShortWays) return Vec3::Zero();
  out_.short_ways += 1;
  Real deepest_m = 0;
  program_.rows.clear();
  for (const ReachedPair& reached : pass_.reached) {
    const ProxyPair& pair = near_.pairs[reached.pair];
    if (!pair.known) continue;
    const PlaneGap gap = plane_gap(pair_at(pair, part_.pose), pair.plane, pair.support);
    tick.work.plane_gaps += 1;
    if (!gap.defined) continue;
    QpRow row;
    row.g.head<3>() = gap.normal_w;
    row.h = -gap.gap_m;
    if (!has_budget(tick) || !program_.rows.push(row)) return Vec3::Zero();
    if (pair.inside) deepest_m = std::max(deepest_m, -gap.gap_m);
  }
  const Real tolerance_m = parameters_.scale.tolerance_m;
  const Vec3 way_m = solve_rows(1.0e-4_r * tolerance_m, tick).z.head<3>();
  for (const QpRow& row : program_.rows) {
    if (row.g.head<3>().dot(way_m) < row.h - tolerance_m / 2) return Vec3::Zero();
  }
  const Real most_m = kFewDepths * deepest_m;
  return way_m.squaredNorm() > most_m * most_m ? Vec3(Vec3::Zero()) : way_m;
}

/// The direction of the shortest way out that the budget lets it find, of the planes of the pairs
/// that p is inside of; @return that way.
Real Proxy::choose_way_out(ProxyTick& tick) noexcept {
  Real way_m = kEndless;
  const auto ask = [&](const ReachedPair& reached, const PlaneId& id) {
    const ProxyPair& pair = near_.pairs[reached.pair];
    const PlaneGap gap = plane_gap(pair_at(pair, part_.pose), id, pair.support);
    tick.work.plane_gaps += 1;
    // Of its own pair alone a way is at least as long as that pair is deep.
    if (!gap.defined || !(-gap.gap_m < way_m)) return;
    const Real far_m = way_out_m(gap.normal_w, std::max(-gap.gap_m, Real{0}), way_m, tick);
    if (!(far_m < way_m)) return;
    way_m = far_m;
    out_.way_w = gap.normal_w;
  };
  for (const ReachedPair& reached : pass_.reached) {
    if (!near_.pairs[reached.pair].inside) continue;
    ask(reached, near_.pairs[reached.pair].plane);
    if (!has_budget(tick)) break;
  }
  for (const ReachedPair& reached : pass_.reached) {
    const ProxyPair& pair = near_.pairs[reached.pair];
    if (!pair.inside) continue;
    if (!has_budget(tick)) break;
    for_each_face(*pair.view, [&](const PlaneId& id) {
      ask(reached, id);
      return has_budget(tick);
    });
  }
  return way_m;
}

/// What a pass of recovery goes: straight on along the way out.
Vec3 Proxy::next_way_out(ProxyTick& tick) noexcept {
  const Real most_m = parameters_.scale.recovery_step_m;
  Vec3 way_w = out_.way_w.isZero(0) ? short_way_out(tick) : Vec3(Vec3::Zero());
  if (const Real far_m = std::sqrt(way_w.squaredNorm()); far_m > 0) {
    if (far_m > most_m) way_w *= most_m / far_m;
    return way_w;
  }
  const Real way_m =
      out_.way_w.isZero(0) ? choose_way_out(tick) : way_out_m(out_.way_w, Real{0}, kEndless, tick);
  // Some pair is inside: where the budget did not tell how far, as far as a pass may go. What is
  // apart by the way may be deep by what counts as free; steps end no deeper, so out to its face.
  const Real out_m = way_m > 0 ? way_m + parameters_.scale.tolerance_m / 2 : most_m;
  return std::min(out_m, most_m) * out_.way_w;
}

/// A pass of recovery, until p is free, for any goal.
void Proxy::lead_out(const GripPose& goal, ProxyTick& tick) noexcept {
  go_out(next_way_out(tick), goal, tick);
}

/// p by so much on its way out.
void Proxy::go_out(const Vec3& way_m, const GripPose& goal, ProxyTick& tick) noexcept {
  const Step step = step_by(way_m, Vec3::Zero());
  part_.pose = step.q;
  part_.version += 1;
  part_.path_m =
      (part_.path_m + static_cast<double>(std::sqrt(step.dx_m.squaredNorm())) * kOdometerUp) *
      (1 + 0x1p-52);
  near_.list.follow(step.dx_m, step.dtheta_rad);
  if (has_screen()) near_.screen->accept(part_.pose, std::sqrt(step.dx_m.squaredNorm()), 0);
  for (ReachedPair& reached : pass_.reached) {  // how deep it is now is told
    const ProxyPair& pair = near_.pairs[reached.pair];
    reached.gap_q_m = clear_m(pair);
    if (!pair.inside) continue;
    tick.work.plane_gaps += 1;
    const PlaneGap gap = plane_gap(pair_at(pair, part_.pose), pair.plane, pair.support);
    if (gap.defined) reached.gap_q_m = gap.gap_m;
  }
  kept_.active.clear();
  program_.imposed.clear();
  kept_.pending.clear();
  program_.cones.clear();
  slip_.last_cones.clear();
  program_.found = QpResult{};
  tick.end_potential_j = potential_j(parameters_.spring, error_of(goal, part_.pose));
  move_.moved_little = pass_.is_short = false;
  tick.limited = true;
}

}  // namespace haptic
