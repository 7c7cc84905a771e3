// SPDX-License-Identifier: Apache-2.0
// One pass of the proxy: a step that every pair certifies.
#include <algorithm>
#include <cmath>

#include "rt_core/base/rotation.hpp"
#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {
namespace {

/// By how much the first retry shrinks the trust region; in the last one it is kLastTolerances. A
/// part that rolls as it slides settles where the pull along the surface is as small against that
/// into it as the last region is short [rad]; and planes that a pair has beside the best one are
/// not imposed for so short a step.
constexpr Real kRetryShare = 0.1_r;
/// Rows linearised at a step hold a part that they let move by no more than this share of its way.
constexpr Real kHeldBack = 0.02_r;
/// Share of the energy that a step lowers it by at least, unless the planes are to be chosen again.
constexpr Real kIdleShare = sizeof(Real) == sizeof(float) ? 1.0e-6_r : 1.0e-9_r;
/// Shares of the tolerance: a gap that deep is eased, by so much in a pass.
constexpr Real kDeepShare = 0.25_r, kEasedShare = 0.125_r;
/// Share of the pull that friction may leave of a part that rests: what creeps so slowly would
/// hardly come to an end.
constexpr Real kRestShare = 3.0e-4_r, kRestTolerances = 3;
/// A step that meets a pair where no plane of it is in the way is tried again with this share of
/// it, some times, and then with what the pair has room for, or at least that share.
constexpr Real kNearerShare = 0.25_r, kRoomShare = 0.9_r, kLeastRoom = 1.0e-3_r;
constexpr std::uint32_t kMostNearer = 3;
/// A step uses up no more than this share of what a list of near pairs leaves that takes long.
constexpr Real kListShare = 0.9_r;
/// A retry goes this many of the scale's steps far at the most.
constexpr Real kRetrySteps = 8;
/// Gaps less negative than this share of the tolerance are not worth a closing.
constexpr Real kClosedShare = 0.02_r;

/// Violation of a row that the quadratic program may leave: a share of the tolerance, or what
/// rounding makes of numbers as large as the error.
Real qp_tolerance(const ProxyScale& scale, const PoseError& error, Real length_m) noexcept {
  const Real size = std::sqrt(error.translation_m.squaredNorm()) +
                    length_m * std::sqrt(error.rotation_rad.squaredNorm());
  return std::max(1.0e-4_r * scale.tolerance_m, 16 * kRealEpsilon * size);
}

}  // namespace

Proxy::Step Proxy::step_by(const Vec3& dx_m, const Vec3& dtheta_rad) const noexcept {
  Step step{moved(p_, dx_m, dtheta_rad), dx_m, dtheta_rad};
  // Configurations beyond the envelope are not considered: every step is shortened to one inside
  // before it is certified and before its cost is compared. p_ itself is inside, from the first
  // goal on.
  const MotionEnvelope& envelope = parameters_.envelope;
  const bool place = envelope.limits_place();
  const bool turn = envelope.limits_turn();
  if (is_locked()) {
    if (place && hold_place(envelope, step.q)) step.dx_m = step.q.x0_w - p_.x0_w;
  } else if ((turn || place) && hold_inside(envelope, step.q)) {
    step.dx_m = step.q.x0_w - p_.x0_w;
    step.dtheta_rad = so3_log((step.q.q_wa * p_.q_wa.conjugate()).normalized());
  }
  return step;
}

/// Moves p to where the spring's energy is lower, if a step there is certified. After every pass p
/// is free, and the energy has not risen over those of the tick.
Proxy::PassEnd Proxy::pass(const GripPose& goal, ProxyTick& tick) noexcept {
  const ProxyScale& scale = parameters_.scale;
  const Spring& spring = parameters_.spring;
  const PoseError error = error_of(goal, p_);
  // The program lowers the energy of the secant, and with it that of the spring.
  secant_ = secant_spring(spring, error);
  gather(error, tick);
  if (tick.inside && climbing_ > 0) return PassEnd::kRejected;
  if (tick.inside) {
    lead_out(goal, tick);
    return PassEnd::kMoved;
  }
  way_out_w_.setZero();
  short_ways_ = 0;
  rows_.clear();
  imposed_.clear();
  begin_cones();
  last_qp_ = QpResult{};
  keeps_active_ = false;
  // A gap that is negative is closed from what the tick has gained, and only then: rows that ask
  // for it raise the energy where the planes hold the part.
  const Real start_j = tick.end_potential_j;
  const Real gained_j = (tick.start_potential_j - start_j) / 2;
  const bool closes =
      may_close_ && gained_j > 0 && worst_gap_m_ < -kClosedShare * scale.tolerance_m;
  // What rubs and slides comes out of a gap that deep a little with every pass, by what its slip
  // gains: where no step could be certified any more friction would hold it.
  const bool eases = has_friction() && held_ == 0 && worst_gap_m_ < -kDeepShare * scale.tolerance_m;
  close_m_ = closes ? scale.tolerance_m : eases ? kEasedShare * scale.tolerance_m : Real{0};
  far_rows_ = false;
  impose_last(error, tick);

  const Real limit_j = closes ? start_j + gained_j : start_j - least_fall_j(start_j);
  Real end_j = start_j;
  const auto affordable = [&](const Step& step) {
    end_j = potential_j(spring, error_of(goal, step.q));
    return end_j <= limit_j || (end_j == 0 && start_j > 0);  // what arrives is done
  };

  Step step;
  const bool found = solve(error, step, tick);
  if (tick.spent) return end_spent();
  tick.residual_n = left_over_n(near_wish_, Vec3::Zero(), Vec3::Zero());
  if (found && !closes && rests(error, tick)) {
    remember_active();
    return PassEnd::kDone;
  }
  bool ok = found && affordable(step);
  if (found && !ok && eases && !closes) {  // it sticks
    remember_active();
    return PassEnd::kDone;
  }
  const bool stays = step.dx_m.isZero(0) && step.dtheta_rad.isZero(0);
  if (found && (stays || (!ok && !closes && (is_still(step) || end_j <= start_j)))) {
    // A fall that patience has not waited for is said.
    if (start_j - end_j > kIdleShare * start_j) tick.limited = true;
    remember_active();
    return PassEnd::kDone;
  }
  // Edges almost parallel turn their plane by any angle at the least turn of the part. Without a
  // turn all planes keep their normals: straight towards the goal and out of what is in the way.
  const auto without_turn = [&](Step& way) {
    const Real far = std::sqrt(error.translation_m.squaredNorm());
    Real most = std::min(scale.step_m, way_left_m_);
    if (has_facets()) most = std::min(most, reach_m_);  // no farther than this pass has looked
    const Real s = far > most ? most / far : Real{1};
    way = step_by(s * error.translation_m, Vec3::Zero());
    return correct(way, tick) && affordable(way);
  };
  if (ok && short_ && !is_locked() && !has_friction() && has_budget(tick)) {
    // Such edges let no longer step be found that turns.
    const Real short_j = end_j;
    Step way;
    if (without_turn(way) && end_j < short_j) {
      step = way;
      short_ = false;
    } else {
      tick.spent = false;
      if (!check(step, -scale.tolerance_m / 2, tick).ok) {
        tick.spent = true;
        return end_spent();
      }
      end_j = short_j;
    }
  }
  if (!ok && climbing_ > 0) return PassEnd::kRejected;
  // What rubs is moved by its cones where they find a step, for other steps would let go of it, and
  // by nothing else once the goal rests.
  const bool may_let_go = !has_friction() || (held_ == 0 && !rests_on_friction());
  const Vec3 dx = step.dx_m, dtheta = step.dtheta_rad;
  if (!ok && !has_friction()) ok = correct(step, tick) && affordable(step);
  if (tick.spent) return end_spent();
  Real share = 0.5_r;
  for (std::uint32_t k = 0; k < kMaxBackOffs && !ok; ++k, share /= 2) {
    if (!may_begin(kRoundGrant, tick)) return end_spent();
    step = step_by(share * dx, share * dtheta);
    ok = check(step, has_friction() ? -scale.tolerance_m / 2 : kCorrectedShare * -scale.tolerance_m,
               tick)
             .ok &&
         affordable(step);
  }
  if (!ok && may_let_go && has_friction()) {
    step = step_by(dx, dtheta);
    ok = correct(step, tick) && affordable(step);
  }
  if (!ok && may_let_go) ok = without_turn(step);
  if (tick.spent) return end_spent();
  remember_active();
  if (!ok) {
    // p is free: nothing is lost. The same planes would lead to the same end: the next pass chooses
    // its planes from the start.
    choose_from_start_ = true;
    may_close_ = false;
    tick.rejected += 1;
    tick.limited = true;
    return PassEnd::kRejected;
  }
  tick.end_potential_j = end_j;
  tick.residual_n = left_over_n(wish_, step.dx_m, step.dtheta_rad);
  accept(step);
  return PassEnd::kMoved;
}

/// Whether the goal rests and friction holds the part where it is, but for a small share of the
/// pull and a few tolerances.
bool Proxy::rests(const PoseError& error, const ProxyTick& tick) const noexcept {
  if (held_ == 0 || !rests_on_friction()) return false;
  const Real most_n = kRestShare * left_over_n(error, Vec3::Zero(), Vec3::Zero());
  const Real most_m = kRestTolerances * parameters_.scale.tolerance_m;
  return tick.residual_n <= std::min(most_n, secant_.k_t_n_per_m * most_m);
}

/// A pass that may begin nothing more: p stays.
Proxy::PassEnd Proxy::end_spent() noexcept {
  if (last_qp_.active_count > 0) remember_active();
  return PassEnd::kSpent;
}

/// Force of the spring along what a program asked for and a step did not do.
Real Proxy::left_over_n(const PoseError& wish, const Vec3& dx_m,
                        const Vec3& dtheta_rad) const noexcept {
  const Real turn_m2 = secant_.length_m * secant_.length_m;
  return secant_.k_t_n_per_m * std::sqrt((wish.translation_m - dx_m).squaredNorm() +
                                         turn_m2 * (wish.rotation_rad - dtheta_rad).squaredNorm());
}

/// The point of the rows that is closest to the origin, and its work counted.
QpResult Proxy::solve_rows(Real tolerance_m, ProxyTick& tick,
                           std::span<const std::uint8_t> first) const noexcept {
  const QpResult found = closest_point(rows_.view(), tolerance_m, first);
  tick.rows = std::max(tick.rows, rows_.size());
  tick.qp_iterations = std::max(tick.qp_iterations, found.iterations);
  tick.qp_programs += 1;
  tick.qp_steps += found.iterations;
  return found;
}

/// Imposes planes until the step that the quadratic program asks for is certified.
bool Proxy::solve(const PoseError& error, Step& step, ProxyTick& tick) noexcept {
  const ProxyScale& scale = parameters_.scale;
  const Real length = secant_.length_m;
  const Real tolerance = qp_tolerance(scale, error, length);
  // A translation may be as long as the pull asks for: its planes keep their normals, so the
  // program is exact for them. A turn is kept short while something is near.
  Real most_m = std::numeric_limits<Real>::max();
  Real most_rad = scale.turn_rad;
  Real share = 1;  // of the program's step, where its way is not certified
  Real far = 0, turn = 0;
  PoseError way;         // what the program asks for within what p may move by
  Real free_motion = 0;  // of the program without rows linearised at a step
  constexpr std::uint32_t kRounds = kProxyRounds + kProxyRetries * kProxyRetryRounds;
  bool from_start = false;
  short_ = whole_ = false;
  bound_programs_ = 0;
  const Real least_m = -scale.tolerance_m / 2;
  std::uint32_t nearer = 0;               // tries of a part of the step
  Step before;                            // that was checked last
  bool chosen_short = false;              // planes chosen from the start, for a short step
  std::uint32_t retry_at = kProxyRounds;  // round at which the next retry starts
  for (std::uint32_t round = 0; round < kRounds; ++round) {
    if (climbing_ > 0 && round == kProxyRounds) return false;
    if (round == retry_at) {
      const bool last = round + kProxyRetryRounds >= kRounds;
      short_ = last;
      const Real longest = std::sqrt(error.translation_m.squaredNorm());
      most_m = last ? kLastTolerances * scale.tolerance_m
                    : kRetryShare * std::clamp(longest, scale.step_m, kRetrySteps * scale.step_m);
      most_rad = last ? most_m / parameters_.radius_m : kRetryShare * most_rad;
      retry_at += kProxyRetryRounds;
      share = 1;
      far_rows_ = false;
      rows_.clear();
      cones_.clear();
      if (from_start) imposed_.clear();
      from_start = false;
      for (std::uint32_t k = 0; k < imposed_.size(); ++k) {
        imposed_[k].times = 0;
        imposed_[k].at_step = false;
        if (!add_rows_at_p(k, error, tick)) break;
      }
    }
    if (!may_begin(kRoundGrant, tick)) return chosen_short && stay_still(step, tick);
    tick.rounds = std::max(tick.rounds, round + 1);
    if (!(share < 1)) {
      last_qp_ = solve_rows(tolerance, tick);
      settle_cones(error, tolerance, tick);
      if (last_qp_.capped) tick.limited = true;
      wish_ = asked(last_qp_.z, error);
      has_wish_ = true;
      way = bounded(error, tolerance, tick);
      far = std::sqrt(way.translation_m.squaredNorm());
      turn = std::sqrt(way.rotation_rad.squaredNorm());
    }
    const Real motion = far + turn * parameters_.radius_m;
    if (!far_rows_) {
      free_motion = motion;
      near_wish_ = wish_;
    }
    Real s = 1;
    if (motion > nearest_m_) {
      if (far > most_m) s = most_m / far;
      if (s * turn > most_rad) s = most_rad / turn;
      s = std::max(s, nearest_m_ / motion);
    }
    Real trust_m = trust_m_;
    if (has_facets()) {
      trust_m = std::max(trust_m, nearest_m_);
      if (has_long_lists() && motion > 0) {
        const auto listed_m = [&] {
          return kListShare * unlisted_m() * motion / list_motion_m(far, turn);
        };
        const Real step_m = std::min(s * motion, trust_m);
        // What a longer step needs is looked up at once where lists are made row by row.
        if (has_screen() && behind_ticks_ == 0 && step_m > listed_m() && has_budget(tick)) {
          widen(step_m, tick);
        }
        const Real list_m = listed_m();
        list_cut_ = list_cut_ || (s * motion > list_m && !(trust_m < list_m));
        trust_m = std::min(trust_m, list_m);
      }
      // The list has been outrun: the part waits for the next one.
      if (motion > trust_m && !(trust_m > scale.still_m)) {
        tick.crowded = tick.crowded || near_pairs_.overflowed();
        tick.spent = true;
        return false;
      }
    }
    const bool trusted = !(s * motion > trust_m);
    if (!trusted) s = trust_m / motion;
    tried_m_ = s * motion;
    longest_ = !trusted && !(trust_m_ < most_trust_m());
    // Place and turn are bounded each by itself, but where planes tie them together.
    const bool cut = !trusted || s * far > way_left_m_ || s * turn > turn_left_rad_;
    Real s_turn = s * turn > turn_left_rad_ ? turn_left_rad_ / turn : s;
    if (s * far > way_left_m_) s = way_left_m_ / far;
    if (last_qp_.active_count > 0) s = s_turn = std::min(s, s_turn);
    s *= share;
    s_turn *= share;
    // What rubs is not crept along by less than a step that counts.
    if (!cones_.empty() && s * far <= scale.still_m && s_turn * turn <= scale.still_rad) {
      s = s_turn = 0;
    }
    step = step_by(s * way.translation_m, s_turn * way.rotation_rad);
    // Nothing holds the part: it arrives to the bit, and the pull is exactly zero.
    if (s == 1 && s_turn == 1 && last_qp_.active_count == 0) step.q = goal_;
    const Check result = check(step, least_m, tick, round > 0 ? &before : nullptr);
    before = step;
    if (tick.spent) return chosen_short && stay_still(step, tick);
    const bool still = is_still(step) || (result.ok && gains_nothing(step, tick));
    if (result.ok) {
      whole_ = !cut && s == 1 && s_turn == 1 && !far_rows_;
      if (cut || (!still && !(far_rows_ && motion < kHeldBack * free_motion))) return true;
      if (share < 1) return !still;
      // Rows linearised at a far step, planes that were the best there, and planes of an earlier
      // pass can hold the proxy where it is: a nearer step, with planes chosen from the start, may
      // be free.
      const bool held_far = far_rows_ || crowded();
      if (!held_far && (chosen_short || rests_on_friction() || !choice_is_due())) return true;
      if (retry_at >= kRounds) return true;
      remember_active();
      if (!held_far) retry_at = kRounds - kProxyRetryRounds;
      round = retry_at - 1;
      from_start = chosen_short = true;
      continue;
    }
    if (!(result.lacking_m > 0)) {
      if (still) return false;
      share *= result.share;
      continue;
    }
    // A plane past the end of its features is none of the contact that is to come: the next one may
    // be, and nearer to it the right one shows.
    const std::uint32_t worst = worst_that_meets(result, step, least_m, tick);
    const ReachedPair& lacking = reached_[result.worst];
    const bool has_room =
        pairs_[lacking.pair].view->has_facet() && lacking.gap_m > scale.tolerance_m;
    if (worst == reached_.size() && has_room) {
      const Real moved_m = s * far + s_turn * turn * parameters_.radius_m;
      const Real least = nearer < kMostNearer ? kNearerShare : kLeastRoom;
      share *= std::max(kRoomShare * std::min<Real>(lacking.gap_m / moved_m, 1), least);
      nearer += 1;
      continue;
    }
    share = 1;
    if (!impose(worst < reached_.size() ? worst : result.worst, step, error, tick)) {
      tick.limited = true;
      return false;
    }
  }
  tick.limited = true;
  return false;
}

/// The motion that the last program asks for.
PoseError Proxy::asked(const QpVector& z, const PoseError& error) const noexcept {
  PoseError wish;
  wish.translation_m = z.head<3>() + error.translation_m;
  if (!is_locked()) {
    wish.rotation_rad = z.tail<3>() / secant_.length_m + error.rotation_rad;
  }
  return wish;
}

/// The planes could not be chosen from the start for want of budget: those that hold p where it is
/// stay, and the tick says that it has not made sure.
bool Proxy::stay_still(Step& step, ProxyTick& tick) noexcept {
  tick.spent = false;
  tick.limited = true;
  keeps_active_ = true;
  step = step_by(Vec3::Zero(), Vec3::Zero());
  return true;
}

/// Whether the goal rests and a step lowers the energy by no more than a part at rest may leave.
bool Proxy::gains_nothing(const Step& step, const ProxyTick& tick) const noexcept {
  if (held_ == 0 || close_m_ > 0) return false;
  const Real end_j = potential_j(parameters_.spring, error_of(goal_, step.q));
  return tick.end_potential_j - end_j < kIdleShare * tick.end_potential_j;
}

bool Proxy::is_still(const Step& step) const noexcept {
  const ProxyScale& scale = parameters_.scale;
  return step.dx_m.squaredNorm() <= scale.still_m * scale.still_m &&
         step.dtheta_rad.squaredNorm() <= scale.still_rad * scale.still_rad;
}

}  // namespace haptic
