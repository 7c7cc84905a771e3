// SPDX-License-Identifier: Apache-2.0
// One pass of the proxy: a step that every pair certifies.
#include <algorithm>
#include <cmath>

#include "rt_core/base/rotation.hpp"
#include "rt_core/proxy/pass_numbers.hpp"
#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {

Proxy::Step Proxy::step_by(const Vec3& dx_m, const Vec3& dtheta_rad) const noexcept {
  Step step{moved(part_.pose, dx_m, dtheta_rad), dx_m, dtheta_rad};
  // Configurations beyond the envelope are not considered: every step is shortened to one inside
  // before it is certified and before its cost is compared. p itself is inside, from the first
  // goal on.
  const MotionEnvelope& envelope = parameters_.envelope;
  const bool place = envelope.limits_place();
  const bool turn = envelope.limits_turn();
  if (is_locked()) {
    if (place && hold_place(envelope, step.q)) step.dx_m = step.q.x0_w - part_.pose.x0_w;
  } else if ((turn || place) && hold_inside(envelope, step.q)) {
    step.dx_m = step.q.x0_w - part_.pose.x0_w;
    step.dtheta_rad = so3_log((step.q.q_wa * part_.pose.q_wa.conjugate()).normalized());
  }
  return step;
}

/// The step of one pass, on the stack, and the energies that bound it.
class Proxy::PassTry {
 public:
  PassTry(Proxy& proxy, const GripPose& goal, const PoseError& error, ProxyTick& tick) noexcept;
  [[nodiscard]] PassEnd run() noexcept;

 private:
  [[nodiscard]] bool affordable(const Step& step) noexcept;
  [[nodiscard]] bool is_done(bool found, bool ok) noexcept;
  [[nodiscard]] bool without_turn(Step& way) noexcept;
  [[nodiscard]] bool go_without_turn() noexcept;
  [[nodiscard]] bool shorten() noexcept;
  [[nodiscard]] bool rescue() noexcept;

  Proxy& proxy_;
  const GripPose& goal_;
  const PoseError& error_;  ///< of the goal against p
  ProxyTick& tick_;
  const ProxyScale& scale_;
  const Real start_j_;                   ///< energy of the spring at p
  Real limit_j_ = 0;                     ///< of a step that is worth it
  Real end_j_ = 0;                       ///< of the step asked about last
  bool closes_ = false, eases_ = false;  ///< the pass closes a negative gap, or eases it
  bool out_of_budget_ = false;           ///< nothing more may be begun
  Step step_;
};

Proxy::PassTry::PassTry(Proxy& proxy, const GripPose& goal, const PoseError& error,
                        ProxyTick& tick) noexcept
    : proxy_(proxy),
      goal_(goal),
      error_(error),
      tick_(tick),
      scale_(proxy.parameters_.scale),
      start_j_(tick.end_potential_j),
      end_j_(tick.end_potential_j) {
  // A gap that is negative is closed from what the tick has gained, and only then: rows that ask
  // for it raise the energy where the planes hold the part.
  const Real gained_j = (tick.start_potential_j - start_j_) / 2;
  const Real worst_m = proxy.pass_.worst_gap_m;
  closes_ = proxy.move_.may_close && gained_j > 0 && worst_m < -kClosedShare * scale_.tolerance_m;
  // What rubs and slides comes out of a gap that deep a little with every pass, by what its slip
  // gains: where no step could be certified any more friction would hold it.
  eases_ =
      proxy.has_friction() && proxy.rest_.held == 0 && worst_m < -kDeepShare * scale_.tolerance_m;
  limit_j_ = closes_ ? start_j_ + gained_j : start_j_ - proxy.least_fall_j(start_j_);
  proxy.program_.close_m = closes_  ? scale_.tolerance_m
                           : eases_ ? kEasedShare * scale_.tolerance_m
                                    : Real{0};
}

bool Proxy::PassTry::affordable(const Step& step) noexcept {
  end_j_ = potential_j(proxy_.parameters_.spring, proxy_.error_of(goal_, step.q));
  return end_j_ <= limit_j_ || (end_j_ == 0 && start_j_ > 0);  // what arrives is done
}

/// True if the step that was `found`, `ok` or not, shows that there is no better place for p.
bool Proxy::PassTry::is_done(bool found, bool ok) noexcept {
  if (!found) return false;
  if (!ok && eases_ && !closes_) return true;  // it sticks
  const bool stays = step_.dx_m.isZero(0) && step_.dtheta_rad.isZero(0);
  if (!stays && (ok || closes_ || !(proxy_.is_still(step_) || end_j_ <= start_j_))) return false;
  // A fall that patience has not waited for is said.
  if (start_j_ - end_j_ > kIdleShare * start_j_) tick_.limited = true;
  return true;
}

/// Edges almost parallel turn their plane by any angle at the least turn of the part. Without a
/// turn all planes keep their normals: straight towards the goal and out of what is in the way.
bool Proxy::PassTry::without_turn(Step& way) noexcept {
  const Real far = std::sqrt(error_.translation_m.squaredNorm());
  Real most = std::min(scale_.step_m, proxy_.move_.way_left_m);
  // No farther than this pass has looked.
  if (proxy_.has_facets()) most = std::min(most, proxy_.pass_.reach_m);
  const Real s = far > most ? most / far : Real{1};
  way = proxy_.step_by(s * error_.translation_m, Vec3::Zero());
  return proxy_.correct(way, tick_) && affordable(way);
}

/// Such edges let no longer step be found that turns; false: the budget has ended.
bool Proxy::PassTry::go_without_turn() noexcept {
  const Real short_j = end_j_;
  Step way;
  if (without_turn(way) && end_j_ < short_j) {
    step_ = way;
    proxy_.pass_.is_short = false;
    return true;
  }
  proxy_.move_.spent = false;
  if (!proxy_.check(step_, -scale_.tolerance_m / 2, tick_).ok) {
    proxy_.move_.spent = true;
    return false;
  }
  end_j_ = short_j;
  return true;
}

/// The same step, halved until it is certified and worth it.
bool Proxy::PassTry::shorten() noexcept {
  const Vec3 dx = step_.dx_m, dtheta = step_.dtheta_rad;
  const Real least_m =
      proxy_.has_friction() ? -scale_.tolerance_m / 2 : kCorrectedShare * -scale_.tolerance_m;
  Real share = 0.5_r;
  for (std::uint32_t k = 0; k < kMaxBackOffs; ++k, share /= 2) {
    out_of_budget_ = !proxy_.may_begin(kRoundGrant, tick_);
    if (out_of_budget_) return false;
    step_ = proxy_.step_by(share * dx, share * dtheta);
    if (proxy_.check(step_, least_m, tick_).ok && affordable(step_)) return true;
  }
  return false;
}

/// A step in place of one that is not certified or not worth it. What rubs is moved by its cones
/// where they find a step, for other steps would let go of it, and by nothing else once the goal
/// rests.
bool Proxy::PassTry::rescue() noexcept {
  const bool friction = proxy_.has_friction();
  const bool may_let_go = !friction || (proxy_.rest_.held == 0 && !proxy_.rests_on_friction());
  const Step asked = step_;
  if (!friction && proxy_.correct(step_, tick_) && affordable(step_)) return true;
  if (proxy_.move_.spent) return false;
  step_.dx_m = asked.dx_m;
  step_.dtheta_rad = asked.dtheta_rad;
  if (shorten()) return true;
  if (out_of_budget_) return false;
  if (may_let_go && friction) {
    step_ = proxy_.step_by(asked.dx_m, asked.dtheta_rad);
    if (proxy_.correct(step_, tick_) && affordable(step_)) return true;
  }
  return may_let_go && without_turn(step_);
}

Proxy::PassEnd Proxy::PassTry::run() noexcept {
  const bool found = proxy_.solve(error_, step_, tick_);
  if (proxy_.move_.spent) return proxy_.end_spent();
  tick_.residual_n = proxy_.left_over_n(proxy_.program_.near_wish, Vec3::Zero(), Vec3::Zero());
  const bool rests = found && !closes_ && proxy_.rests(error_, tick_);
  bool ok = !rests && found && affordable(step_);
  if (rests || is_done(found, ok)) {
    proxy_.remember_active();
    return PassEnd::kDone;
  }
  const bool turns_short = ok && proxy_.pass_.is_short && !proxy_.is_locked();
  if (turns_short && !proxy_.has_friction() && proxy_.has_budget(tick_) && !go_without_turn()) {
    return proxy_.end_spent();
  }
  if (!ok && proxy_.climb_.leg > 0) return PassEnd::kRejected;
  if (!ok) ok = rescue();
  if (proxy_.move_.spent) return proxy_.end_spent();
  proxy_.remember_active();
  if (!ok) {
    // p is free: nothing is lost. The same planes would lead to the same end: the next pass chooses
    // its planes from the start.
    proxy_.rest_.choose_from_start = true;
    proxy_.move_.may_close = false;
    if (proxy_.climb_.leg == 0) tick_.work.rejected += 1;
    tick_.limited = true;
    return PassEnd::kRejected;
  }
  tick_.end_potential_j = end_j_;
  tick_.residual_n = proxy_.left_over_n(proxy_.program_.wish, step_.dx_m, step_.dtheta_rad);
  proxy_.accept(step_);
  return PassEnd::kMoved;
}

/// Moves p to where the spring's energy is lower, if a step there is certified. After every pass p
/// is free, and the energy has not risen over those of the tick.
Proxy::PassEnd Proxy::pass(const GripPose& goal, ProxyTick& tick) noexcept {
  const PoseError error = error_of(goal, part_.pose);
  // The program lowers the energy of the secant, and with it that of the spring.
  program_.secant = secant_spring(parameters_.spring, error);
  gather(error, tick);
  if (pass_.inside && climb_.leg > 0) return PassEnd::kRejected;
  if (pass_.inside) {
    lead_out(goal, tick);
    return PassEnd::kMoved;
  }
  out_.way_w.setZero();
  out_.short_ways = 0;
  begin_program();
  PassTry attempt(*this, goal, error, tick);
  impose_last(error, tick);
  return attempt.run();
}

void Proxy::begin_program() noexcept {
  program_.rows.clear();
  program_.imposed.clear();
  begin_cones();
  program_.found = QpResult{};
  program_.far_rows = false;
  pass_.keeps_active = false;
}

/// True if the goal rests and friction holds the part where it is, but for a small share of the
/// pull and a few tolerances.
bool Proxy::rests(const PoseError& error, const ProxyTick& tick) const noexcept {
  if (rest_.held == 0 || !rests_on_friction()) return false;
  const Real most_n = kRestShare * left_over_n(error, Vec3::Zero(), Vec3::Zero());
  const Real most_m = kRestTolerances * parameters_.scale.tolerance_m;
  return tick.residual_n <= std::min(most_n, program_.secant.k_t_n_per_m * most_m);
}

/// A pass that may begin nothing more: p stays.
Proxy::PassEnd Proxy::end_spent() noexcept {
  if (program_.found.active_count > 0) remember_active();
  return PassEnd::kSpent;
}

/// Force of the spring along what a program asked for and a step did not do.
Real Proxy::left_over_n(const PoseError& wish, const Vec3& dx_m,
                        const Vec3& dtheta_rad) const noexcept {
  const Real turn_m2 = program_.secant.length_m * program_.secant.length_m;
  return program_.secant.k_t_n_per_m *
         std::sqrt((wish.translation_m - dx_m).squaredNorm() +
                   turn_m2 * (wish.rotation_rad - dtheta_rad).squaredNorm());
}

}  // namespace haptic
