// SPDX-License-Identifier: Apache-2.0
// How far the proxy may move in one tick, and what a program asks for within that.
#include <algorithm>
#include <cmath>

#include "rt_core/proxy/pass_numbers.hpp"
#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {
namespace {

/// Programs of one round with rows for what p may move by. They are worth it where the way and the
/// turn may be done to shares this far apart.
constexpr std::uint32_t kMaxBoundsOfRound = 2;
constexpr Real kHeldUp = 0.5_r;
}  // namespace

/// How far p may move in this tick: as far as the goal has, which in free space is all of its way,
/// and what lets go of the pull that contact has built up, over several ticks. What the goal has
/// come in ticks that had no budget to follow is still to be done.
void Proxy::bound_move(const GripPose& goal) noexcept {
  const Spring& spring = parameters_.spring;
  const PoseError error = error_of(goal, part_.pose);
  if (move_.behind_ticks == 0) move_.came_m = move_.came_rad = 0;
  move_.came_m += std::sqrt((goal.x0_w - rest_.goal.x0_w).squaredNorm());
  move_.way_left_m =
      move_.came_m + std::max(kRelease_n / spring.k_t_n_per_m,
                              kReleaseShare * std::sqrt(error.translation_m.squaredNorm()));
  if (is_locked()) return;
  const Real chord2 = std::min((goal.q_wa.coeffs() - rest_.goal.q_wa.coeffs()).squaredNorm(),
                               (goal.q_wa.coeffs() + rest_.goal.q_wa.coeffs()).squaredNorm());
  move_.came_rad += kTurnOfChord * std::sqrt(chord2);
  move_.turn_left_rad =
      move_.came_rad + std::max(kReleaseTurn_n * parameters_.radius_m / spring.k_r_nm_per_rad,
                                kReleaseShare * std::sqrt(error.rotation_rad.squaredNorm()));
}

Real Proxy::held_m() const noexcept { return std::sqrt(program_.found.z.head<3>().squaredNorm()); }

bool Proxy::may_move() const noexcept {
  const ProxyScale& scale = parameters_.scale;
  return move_.way_left_m > scale.still_m && (is_locked() || move_.turn_left_rad > scale.still_rad);
}

/// What the last program asks for, where p is held and may not come so far in this tick: where its
/// turn has to wait much more than its way, or the other way round, a row cuts off what is beyond,
/// so that the one does not hold up the other.
PoseError Proxy::bounded(const PoseError& error, Real tolerance_m, ProxyTick& tick) noexcept {
  PoseError way = program_.wish;
  for (std::uint32_t k = 0; k < kMaxBoundsOfRound && program_.bound_programs < kMaxBoundPrograms;
       ++k) {
    if (is_locked() || program_.found.active_count == 0) break;
    const Real far = std::sqrt(way.translation_m.squaredNorm());
    const Real turn = std::sqrt(way.rotation_rad.squaredNorm());
    const Real far_share = far > move_.way_left_m ? move_.way_left_m / far : Real{1};
    const Real turn_share = turn > move_.turn_left_rad ? move_.turn_left_rad / turn : Real{1};
    if (!(std::min(far_share, turn_share) < kHeldUp * std::max(far_share, turn_share))) break;
    if (tick.work.units() > parameters_.work_units / 2) break;
    QpRow row;
    if (turn_share < far_share) {
      const Vec3 along = way.rotation_rad / turn;
      row.g.tail<3>() = -along;
      row.h = program_.secant.length_m * (along.dot(error.rotation_rad) - move_.turn_left_rad);
    } else {
      const Vec3 along = way.translation_m / far;
      row.g.head<3>() = -along;
      row.h = along.dot(error.translation_m) - move_.way_left_m;
    }
    if (program_.rows.size() >= kMaxProxyRows || !program_.rows.push(row)) break;
    program_.row_plane[program_.rows.size() - 1] = kMaxImposedPlanes;
    if (!program_.row_cone.empty()) program_.row_cone[program_.rows.size() - 1] = kMaxFrictionCones;
    program_.bound_programs += 1;
    const QpResult last = program_.found;
    program_.found = solve_rows(tolerance_m, tick, std::span(last.active).first(last.active_count));
    settle_cones(error, tolerance_m, tick);
    way = asked(program_.found.z, error);
  }
  return way;
}

}  // namespace haptic
