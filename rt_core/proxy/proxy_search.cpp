// SPDX-License-Identifier: Apache-2.0
// The search of a pass for a step that every pair certifies.
#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/proxy/pass_numbers.hpp"
#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {
namespace {

/// Where lists have cut a step short the next one may be so much longer.
constexpr Real kLongerSteps = 4;

/// Violation of a row that the quadratic program may leave: a share of the tolerance, or what
/// rounding makes of numbers as large as the error.
Real qp_tolerance(const ProxyScale& scale, const PoseError& error, Real length_m) noexcept {
  const Real size = std::sqrt(error.translation_m.squaredNorm()) +
                    length_m * std::sqrt(error.rotation_rad.squaredNorm());
  return std::max(1.0e-4_r * scale.tolerance_m, 16 * kRealEpsilon * size);
}

}  // namespace

/// The point of the rows that is closest to the origin, and its work counted.
QpResult Proxy::solve_rows(Real tolerance_m, ProxyTick& tick,
                           std::span<const std::uint8_t> first) const noexcept {
  const QpResult found = closest_point(program_.rows.view(), tolerance_m, first);
  tick.work.rows = std::max(tick.work.rows, program_.rows.size());
  tick.work.qp_iterations = std::max(tick.work.qp_iterations, found.iterations);
  tick.work.qp_programs += 1;
  tick.work.qp_steps += found.iterations;
  return found;
}

/// The search of one pass for a step: rounds of program, step and check, on the stack.
///
/// A translation may be as long as the pull asks for: its planes keep their normals, so the program
/// is exact for them. A turn is kept short while something is near.
class Proxy::StepSearch {
 public:
  StepSearch(Proxy& proxy, const PoseError& error, ProxyTick& tick) noexcept;
  /// Imposes planes until the step that the quadratic program asks for is certified.
  [[nodiscard]] bool run(Step& step) noexcept;

 private:
  /// How a round goes on.
  enum class Round : std::uint8_t { kFound, kNone, kNext };

  void begin_retry() noexcept;
  void solve_program() noexcept;
  [[nodiscard]] Real share_of_way() const noexcept;
  [[nodiscard]] Real trusted_m(Real s) noexcept;
  [[nodiscard]] bool may_widen() const noexcept;
  [[nodiscard]] bool choose_step(Step& step) noexcept;
  [[nodiscard]] Round take_certified(bool still) noexcept;
  [[nodiscard]] Round impose_lacking(const Step& step, const Check& result) noexcept;

  static constexpr std::uint32_t kRounds = kProxyRounds + kProxyRetries * kProxyRetryRounds;

  Proxy& proxy_;
  PassProgram& program_;
  PassState& pass_;
  ProxyTick& tick_;
  const PoseError& error_;  ///< of the goal against p
  const ProxyScale& scale_;
  const Real tolerance_m_;  ///< of the program
  std::uint32_t round_ = 0;
  std::uint32_t retry_at_ = kProxyRounds;  ///< round at which the next retry starts
  Real most_m_ = std::numeric_limits<Real>::max(), most_rad_;  ///< of a step with something near
  Real share_ = 1;                 ///< of the program's step, where its way is not certified
  PoseError way_;                  ///< what the program asks for within what p may move by
  Real far_m_ = 0, turn_rad_ = 0;  ///< lengths of it
  Real motion_m_ = 0;              ///< of both
  Real free_motion_m_ = 0;   ///< motion that the program without rows linearised at a step asks for
  Real s_ = 1, s_turn_ = 1;  ///< shares of way and turn that the step takes
  bool cut_ = false;  ///< the step is shorter than asked for what is trusted, or may be moved
  bool from_start_ = false;    ///< the next retry chooses its planes from the start
  bool chosen_short_ = false;  ///< planes were chosen from the start, for a short step
  std::uint32_t nearer_ = 0;   ///< tries of a part of the step
  Step before_;                ///< that was checked last
};

Proxy::StepSearch::StepSearch(Proxy& proxy, const PoseError& error, ProxyTick& tick) noexcept
    : proxy_(proxy),
      program_(proxy.program_),
      pass_(proxy.pass_),
      tick_(tick),
      error_(error),
      scale_(proxy.parameters_.scale),
      tolerance_m_(qp_tolerance(scale_, error, program_.secant.length_m)),
      most_rad_(scale_.turn_rad) {
  pass_.is_short = pass_.whole = false;
  program_.bound_programs = 0;
}

/// The next tries are shorter ones, with the rows of the planes at p alone.
void Proxy::StepSearch::begin_retry() noexcept {
  const bool last = round_ + kProxyRetryRounds >= kRounds;
  pass_.is_short = last;
  const Real longest = std::sqrt(error_.translation_m.squaredNorm());
  most_m_ = last ? kLastTolerances * scale_.tolerance_m
                 : kRetryShare * std::clamp(longest, scale_.step_m, kRetrySteps * scale_.step_m);
  most_rad_ = last ? most_m_ / proxy_.parameters_.radius_m : kRetryShare * most_rad_;
  retry_at_ += kProxyRetryRounds;
  share_ = 1;
  program_.far_rows = false;
  program_.rows.clear();
  program_.cones.clear();
  if (from_start_) program_.imposed.clear();
  from_start_ = false;
  for (std::uint32_t k = 0; k < program_.imposed.size(); ++k) {
    program_.imposed[k].times = 0;
    program_.imposed[k].at_step = false;
    if (!proxy_.add_rows_at_p(k, error_, tick_)) break;
  }
}

void Proxy::StepSearch::solve_program() noexcept {
  program_.found = proxy_.solve_rows(tolerance_m_, tick_);
  proxy_.settle_cones(error_, tolerance_m_, tick_);
  if (program_.found.capped) tick_.limited = true;
  program_.wish = proxy_.asked(program_.found.z, error_);
  program_.has_wish = true;
  way_ = proxy_.bounded(error_, tolerance_m_, tick_);
  far_m_ = std::sqrt(way_.translation_m.squaredNorm());
  turn_rad_ = std::sqrt(way_.rotation_rad.squaredNorm());
}

/// Of what the program asks for, what may be tried with something near.
Real Proxy::StepSearch::share_of_way() const noexcept {
  if (!(motion_m_ > pass_.nearest_m)) return 1;
  Real s = 1;
  if (far_m_ > most_m_) s = most_m_ / far_m_;
  if (s * turn_rad_ > most_rad_) s = most_rad_ / turn_rad_;
  return std::max(s, pass_.nearest_m / motion_m_);
}

/// The longest motion that is trusted, where a share s of the way is asked for.
Real Proxy::StepSearch::trusted_m(Real s) noexcept {
  Real trust_m = proxy_.range_.trust_m;
  proxy_.move_.list_cut = false;
  if (!proxy_.has_facets()) return trust_m;
  trust_m = std::max(trust_m, pass_.nearest_m);
  if (!proxy_.has_long_lists() || !(motion_m_ > 0)) return trust_m;
  const Real list_m =
      kListShare * proxy_.unlisted_m() * motion_m_ / proxy_.list_motion_m(far_m_, turn_rad_);
  proxy_.move_.list_cut = s * motion_m_ > list_m && !(trust_m < list_m);
  return std::min(trust_m, list_m);
}

/// The step of this round; false: the list has been outrun, and the part waits for the next one.
bool Proxy::StepSearch::choose_step(Step& step) noexcept {
  motion_m_ = far_m_ + turn_rad_ * proxy_.parameters_.radius_m;
  if (!program_.far_rows) {
    free_motion_m_ = motion_m_;
    program_.near_wish = program_.wish;
  }
  Real s = share_of_way();
  const Real trust_m = trusted_m(s);
  if (proxy_.has_facets() && motion_m_ > trust_m && !(trust_m > scale_.still_m)) {
    tick_.crowded = tick_.crowded || proxy_.near_.list.overflowed();
    proxy_.move_.spent = true;
    return false;
  }
  const bool trusted = !(s * motion_m_ > trust_m);
  if (!trusted) s = trust_m / motion_m_;
  pass_.tried_m = s * motion_m_;
  TickMove& move = proxy_.move_;
  move.longest = !trusted && !(proxy_.range_.trust_m < proxy_.most_trust_m());
  // Place and turn are bounded each by itself, but where planes tie them together.
  cut_ = !trusted || s * far_m_ > move.way_left_m || s * turn_rad_ > move.turn_left_rad;
  Real s_turn = s * turn_rad_ > move.turn_left_rad ? move.turn_left_rad / turn_rad_ : s;
  if (s * far_m_ > move.way_left_m) s = move.way_left_m / far_m_;
  if (program_.found.active_count > 0) s = s_turn = std::min(s, s_turn);
  s *= share_;
  s_turn *= share_;
  // What rubs is not crept along by less than a step that counts.
  if (!program_.cones.empty() && s * far_m_ <= scale_.still_m &&
      s_turn * turn_rad_ <= scale_.still_rad) {
    s = s_turn = 0;
  }
  s_ = s;
  s_turn_ = s_turn;
  step = proxy_.step_by(s * way_.translation_m, s_turn * way_.rotation_rad);
  // Nothing holds the part: it arrives to the bit, and the pull is exactly zero.
  if (s == 1 && s_turn == 1 && program_.found.active_count == 0) step.q = proxy_.rest_.goal;
  return true;
}

/// True if a certified step is cut short by lists that are made row by row, and may be longer: not
/// before, for what a program asks for before it knows what is in the way is far longer.
bool Proxy::StepSearch::may_widen() const noexcept {
  return proxy_.move_.list_cut && proxy_.has_screen() && proxy_.move_.behind_ticks == 0 &&
         round_ + 1 < retry_at_ && proxy_.has_budget(tick_);
}

/// A step is certified: it is the one, or a nearer one is tried, with planes chosen from the start.
/// Rows linearised at a far step, planes that were the best there, and planes of an earlier pass
/// can hold the proxy where it is.
Proxy::StepSearch::Round Proxy::StepSearch::take_certified(bool still) noexcept {
  if (may_widen()) {
    proxy_.widen(std::min(kLongerSteps * pass_.tried_m, motion_m_), tick_);
    return Round::kNext;
  }
  pass_.whole = !cut_ && s_ == 1 && s_turn_ == 1 && !program_.far_rows;
  const bool held_back = program_.far_rows && motion_m_ < kHeldBack * free_motion_m_;
  if (cut_ || (!still && !held_back)) return Round::kFound;
  if (share_ < 1) return still ? Round::kNone : Round::kFound;
  const bool held_far = program_.far_rows || proxy_.crowded();
  if (!held_far && (chosen_short_ || proxy_.rests_on_friction() || !proxy_.choice_is_due())) {
    return Round::kFound;
  }
  if (retry_at_ >= kRounds) return Round::kFound;
  proxy_.remember_active();
  if (!held_far) retry_at_ = kRounds - kProxyRetryRounds;
  round_ = retry_at_ - 1;
  from_start_ = chosen_short_ = true;
  return Round::kNext;
}

/// Imposes the plane that a step lacks most. One past the end of its features is none of the
/// contact that is to come: the next one may be, and nearer to it the right one shows.
Proxy::StepSearch::Round Proxy::StepSearch::impose_lacking(const Step& step,
                                                           const Check& result) noexcept {
  const Real least_m = -scale_.tolerance_m / 2;
  const std::uint32_t worst = proxy_.worst_that_meets(result, step, least_m, tick_);
  const ReachedPair& lacking = pass_.reached[result.worst];
  const bool has_room =
      proxy_.near_.pairs[lacking.pair].view->has_facet() && lacking.gap_m > scale_.tolerance_m;
  if (worst == pass_.reached.size() && has_room) {
    const Real moved_m = s_ * far_m_ + s_turn_ * turn_rad_ * proxy_.parameters_.radius_m;
    const Real least = nearer_ < kMostNearer ? kNearerShare : kLeastRoom;
    share_ *= std::max(kRoomShare * std::min<Real>(lacking.gap_m / moved_m, 1), least);
    nearer_ += 1;
    return Round::kNext;
  }
  share_ = 1;
  const std::uint32_t number = worst < pass_.reached.size() ? worst : result.worst;
  return proxy_.impose(number, step, error_, tick_) ? Round::kNext : Round::kNone;
}

bool Proxy::StepSearch::run(Step& step) noexcept {
  for (; round_ < kRounds; ++round_) {
    if (proxy_.climb_.leg > 0 && round_ == kProxyRounds) return false;
    if (round_ == retry_at_) begin_retry();
    if (!proxy_.may_begin(kRoundGrant, tick_))
      return chosen_short_ && proxy_.stay_still(step, tick_);
    tick_.work.rounds = std::max(tick_.work.rounds, round_ + 1);
    if (!(share_ < 1)) solve_program();
    if (!choose_step(step)) return false;
    const bool is_first = round_ == 0;
    const Check result =
        proxy_.check(step, -scale_.tolerance_m / 2, tick_, is_first ? nullptr : &before_);
    before_ = step;
    if (proxy_.move_.spent) return chosen_short_ && proxy_.stay_still(step, tick_);
    const bool still = proxy_.is_still(step) || (result.ok && proxy_.gains_nothing(step, tick_));
    if (result.ok) {
      const Round end = take_certified(still);
      if (end != Round::kNext) return end == Round::kFound;
    } else if (!(result.lacking_m > 0)) {
      if (still) return false;
      share_ *= result.share;
    } else if (impose_lacking(step, result) == Round::kNone) {
      break;
    }
  }
  tick_.limited = true;
  return false;
}

/// Imposes planes until the step that the quadratic program asks for is certified.
bool Proxy::solve(const PoseError& error, Step& step, ProxyTick& tick) noexcept {
  return StepSearch(*this, error, tick).run(step);
}

/// The motion that the last program asks for.
PoseError Proxy::asked(const QpVector& z, const PoseError& error) const noexcept {
  PoseError wish;
  wish.translation_m = z.head<3>() + error.translation_m;
  if (!is_locked()) {
    wish.rotation_rad = z.tail<3>() / program_.secant.length_m + error.rotation_rad;
  }
  return wish;
}

/// The planes could not be chosen from the start for want of budget: those that hold p where it is
/// stay, and the tick says that it has not made sure.
bool Proxy::stay_still(Step& step, ProxyTick& tick) noexcept {
  move_.spent = false;
  tick.limited = true;
  pass_.keeps_active = true;
  step = step_by(Vec3::Zero(), Vec3::Zero());
  return true;
}

/// True if the goal rests and a step lowers the energy by no more than a part at rest may leave.
bool Proxy::gains_nothing(const Step& step, const ProxyTick& tick) const noexcept {
  if (rest_.held == 0 || program_.close_m > 0) return false;
  const Real end_j = potential_j(parameters_.spring, error_of(rest_.goal, step.q));
  return tick.end_potential_j - end_j < kIdleShare * tick.end_potential_j;
}

bool Proxy::is_still(const Step& step) const noexcept {
  const ProxyScale& scale = parameters_.scale;
  return step.dx_m.squaredNorm() <= scale.still_m * scale.still_m &&
         step.dtheta_rad.squaredNorm() <= scale.still_rad * scale.still_rad;
}

}  // namespace haptic
