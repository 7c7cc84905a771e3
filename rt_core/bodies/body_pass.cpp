// SPDX-License-Identifier: Apache-2.0
// One pass of several bodies: a step that every pair of them certifies.
#include <algorithm>
#include <cmath>

#include "rt_core/base/rotation.hpp"
#include "rt_core/bodies/body_search.hpp"
#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {
namespace {

/// Differences of the sum of energies up to so many roundings of it tell nothing.
constexpr Real kEnergyRoundings = 32;

}  // namespace

Real BodyLaw::sum_j() const noexcept {
  Real sum = 0;
  for (const Body& body : bodies())
    sum += haptic::potential_j(body.is.spring, pose_error(body.goal, body.p));
  return sum;
}

/// The step of one pass, on the stack, and the energies that bound it.
class BodyLaw::PassTry {
 public:
  PassTry(BodyLaw& law, BodiesTick& told, ProxyTick& tick) noexcept;
  [[nodiscard]] PassEnd run() noexcept;

 private:
  [[nodiscard]] bool affordable(const Step& step) noexcept;
  [[nodiscard]] bool is_done(bool found, bool ok) const noexcept;
  [[nodiscard]] bool try_shorter(const Step& asked) noexcept;
  [[nodiscard]] bool try_each(const Step& asked) noexcept;
  [[nodiscard]] bool try_without_turn() noexcept;
  [[nodiscard]] bool go_without_turn() noexcept;
  [[nodiscard]] bool rescue() noexcept;
  [[nodiscard]] bool certified(const Step& step, Real least_m) noexcept;
  [[nodiscard]] bool rests(Real residual_n) const noexcept;
  [[nodiscard]] bool let_arrive() noexcept;

  BodyLaw& law_;
  BodiesTick& told_;
  ProxyTick& tick_;
  const ProxyScale& scale_;
  const Real start_j_;
  Real limit_j_ = 0;                     ///< energy of a step that is worth it
  Real end_j_;                           ///< of the step asked about last
  bool closes_ = false, eases_ = false;  ///< the pass closes a negative gap, or eases it
  Step step_;
};

BodyLaw::PassTry::PassTry(BodyLaw& law, BodiesTick& told, ProxyTick& tick) noexcept
    : law_(law),
      told_(told),
      tick_(tick),
      scale_(law.parameters_.scale),
      start_j_(told.end_potential_j),
      end_j_(told.end_potential_j) {
  const Real gained_j = (told.start_potential_j - start_j_) / 2;
  Real worst_m = 0, least_n_per_m = std::numeric_limits<Real>::max();
  for (const BodyPair& pair : law.pairs_) worst_m = std::min(worst_m, pair.worst_gap_m());
  for (const Body& body : law.bodies())
    least_n_per_m = std::min(least_n_per_m, body.is.spring.k_t_n_per_m);
  closes_ = law.may_close_ && gained_j > 0 && worst_m < -kClosedShare * scale_.tolerance_m;
  eases_ = law.has_friction() && law.held_ == 0 && worst_m < -kDeepShare * scale_.tolerance_m;
  Real least_fall_j = least_n_per_m * scale_.still_m * scale_.still_m / 2 +
                      kEnergyRoundings * kRealEpsilon * start_j_;
  for (std::uint32_t k = kPatience; k < std::min(law.slow_, kMostHeld); k += 2) least_fall_j *= 2;
  limit_j_ = closes_ ? start_j_ + gained_j : start_j_ - least_fall_j;
  law.close_m_ = closes_ ? scale_.tolerance_m : eases_ ? kEasedShare * scale_.tolerance_m : Real{0};
}

bool BodyLaw::PassTry::affordable(const Step& step) noexcept {
  end_j_ = law_.sum_j(step);
  return end_j_ <= limit_j_ || (end_j_ == 0 && start_j_ > 0);  // what arrives is done
}

/// True if the step that was `found`, `ok` or not, shows that there is no better place.
bool BodyLaw::PassTry::is_done(bool found, bool ok) const noexcept {
  if (!found) return false;
  if (!ok && eases_ && !closes_) return true;  // it sticks
  const bool stays = std::all_of(
      step_.motion.begin(), step_.motion.begin() + law_.count_,
      [](const BodyMotion& m) { return m.translation_m.isZero(0) && m.rotation_rad.isZero(0); });
  // A rise by roundings is none: in single precision they are more than a short step gains.
  const Real same_j = start_j_ + kEnergyRoundings * kRealEpsilon * start_j_;
  return stays || (!ok && !closes_ && (law_.is_still(step_) || end_j_ <= same_j));
}

/// True if the goals rest and friction holds the bodies where they are: those that are held back
/// but for a small share of the pull and a few tolerances, the others but for a force that is told
/// as none.
bool BodyLaw::PassTry::rests(Real residual_n) const noexcept {
  if (law_.held_ == 0) return false;
  const bool holds = std::any_of(law_.pairs_.begin(), law_.pairs_.end(),
                                 [](const BodyPair& pair) { return pair.rests_on_friction(); });
  if (!holds) return false;
  Real pull_n = 0, most_n = std::numeric_limits<Real>::max();
  for (const Body& body : law_.bodies()) {
    const auto size_n = [&](const BodyMotion& of) {
      return body.secant.k_t_n_per_m *
             root_of_squares(norm_of(of.translation_m),
                             body.secant.length_m * norm_of(of.rotation_rad));
    };
    if (!body.is.is_held_back) {
      // A program for a share of the pull leaves that share of it.
      if (size_n(body.wish) > body.pull_share * (kResidual_n / 2)) return false;
      continue;
    }
    pull_n = std::max(pull_n, size_n(body.error));
    most_n = std::min(most_n, body.secant.k_t_n_per_m * kRestTolerances * scale_.tolerance_m);
  }
  return residual_n <= std::min(kRestShare * pull_n, most_n);
}

bool BodyLaw::PassTry::certified(const Step& step, Real least_m) noexcept {
  if (!law_.has_budget(tick_)) return false;
  const Check result = law_.check(step, least_m, false, tick_);
  return result.ok && affordable(step);
}

/// The same step, halved until it is certified and worth it.
bool BodyLaw::PassTry::try_shorter(const Step& asked) noexcept {
  const Real least_m = (law_.has_friction() ? 0.5_r : kCorrectedShare) * -scale_.tolerance_m;
  Real share = 0.5_r;
  for (std::uint32_t k = 0; k < kMaxBackOffs; ++k, share /= 2) {
    std::array<BodyMotion, kMostMovingBodies> motion;
    for (std::uint32_t i = 0; i < law_.count_; ++i) {
      motion[i] = {share * asked.motion[i].translation_m, share * asked.motion[i].rotation_rad};
    }
    step_ = law_.step_by(motion);
    if (certified(step_, least_m)) return true;
  }
  return false;
}

/// Each body by itself: those that it would take along stay.
bool BodyLaw::PassTry::try_each(const Step& asked) noexcept {
  for (std::uint32_t i = 0; i < law_.count_; ++i) {
    std::array<BodyMotion, kMostMovingBodies> motion;
    motion[i] = asked.motion[i];
    step_ = law_.step_by(motion);
    if (certified(step_, kCorrectedShare * -scale_.tolerance_m)) return true;
  }
  return false;
}

/// Straight towards the goals and out of what is in the way: without a turn all planes of bodies
/// that do not turn keep their normals.
bool BodyLaw::PassTry::try_without_turn() noexcept {
  std::array<BodyMotion, kMostMovingBodies> motion;
  for (std::uint32_t i = 0; i < law_.count_; ++i) {
    const Body& body = law_.bodies_[i];
    const Real far_m = norm_of(body.error.translation_m);
    const Real most_m = std::min(scale_.step_m, body.way_left_m);
    const Real s = far_m > most_m ? most_m / far_m : Real{1};
    motion[i].translation_m = s * body.error.translation_m;
  }
  step_ = law_.step_by(motion);
  return law_.correct(step_, tick_) && affordable(step_);
}

/// Where edges almost parallel let no longer step be found that turns; false: the budget has ended.
bool BodyLaw::PassTry::go_without_turn() noexcept {
  const Step asked = step_;
  const Real asked_j = end_j_;
  if (try_without_turn() && end_j_ < asked_j) {
    law_.is_short_ = false;
    return true;
  }
  step_ = asked;
  const bool ok =
      law_.has_budget(tick_) && law_.check(step_, -scale_.tolerance_m / 2, false, tick_).ok;
  end_j_ = asked_j;
  return ok;
}

/// A step in place of one that is not certified or not worth it.
bool BodyLaw::PassTry::rescue() noexcept {
  const Step asked = step_;
  const bool friction = law_.has_friction();
  const bool may_let_go =
      !friction || (law_.held_ == 0 &&
                    std::none_of(law_.pairs_.begin(), law_.pairs_.end(),
                                 [](const BodyPair& pair) { return pair.rests_on_friction(); }));
  const auto corrected = [&] {
    step_ = asked;
    return law_.correct(step_, tick_) && affordable(step_);
  };
  if (!friction && corrected()) return true;
  if (try_shorter(asked)) return true;
  if (!may_let_go) return try_each(asked);
  return (friction && corrected()) || try_without_turn() || try_each(asked);
}

/// Where the others have come to their places: bodies that nothing touches and that would arrive
/// do, however little that is of the energy of all.
bool BodyLaw::PassTry::let_arrive() noexcept {
  std::array<BodyMotion, kMostMovingBodies> motion;
  std::array<bool, kMostMovingBodies> goes{};
  bool some = false;
  for (std::uint32_t i = 0; i < law_.count_; ++i) {
    const Body& body = law_.bodies_[i];
    const BodyMotion& way = step_.motion[i];
    const bool moves = !(way.translation_m.isZero(0) && way.rotation_rad.isZero(0));
    const bool arrives =
        step_.q[i].x0_w == body.goal.x0_w && step_.q[i].q_wa.coeffs() == body.goal.q_wa.coeffs();
    if (body.is_touched || !moves || !arrives) continue;
    motion[i] = way;
    goes[i] = some = true;
  }
  if (!some || !law_.has_budget(tick_)) return false;
  Step step;
  step.motion = motion;
  for (std::uint32_t i = 0; i < law_.count_; ++i)
    step.q[i] = goes[i] ? step_.q[i] : law_.bodies_[i].p;
  if (!law_.check(step, -scale_.tolerance_m / 2, false, tick_).ok) return false;
  const Real end_j = law_.sum_j(step);
  if (end_j > start_j_) return false;
  told_.end_potential_j = end_j;
  law_.accept(step, true);
  return true;
}

BodyLaw::PassEnd BodyLaw::PassTry::run() noexcept {
  for (BodyPair& pair : law_.pairs_)
    pair.impose_last(law_.close_m_, law_.choose_from_start_, tick_);
  law_.choose_from_start_ = false;
  StepSearch search(law_, tick_);
  const bool found = search.run(step_);
  if (search.is_spent()) return PassEnd::kSpent;
  told_.residual_n = search.residual_n();
  const bool at_rest = found && !closes_ && rests(search.residual_n());
  bool ok = !at_rest && found && affordable(step_);
  if (at_rest || is_done(found, ok)) {
    law_.remember_active();
    return let_arrive() ? PassEnd::kMoved : PassEnd::kDone;
  }
  const Step asked = step_;
  law_.remember_active();
  if (ok && law_.is_short_ && !law_.has_friction() && !go_without_turn()) return PassEnd::kSpent;
  if (!ok) ok = rescue();
  if (!ok && !law_.has_budget(tick_)) return PassEnd::kSpent;
  if (!ok) {
    step_ = asked;
    if (let_arrive()) return PassEnd::kMoved;
    // All are free: nothing is lost. The next pass chooses its planes from the start; that to close
    // a gap would cost too much says nothing of them.
    law_.choose_from_start_ = !closes_;
    law_.may_close_ = false;
    tick_.work.rejected += closes_ ? 0 : 1;
    tick_.limited = tick_.limited || !closes_;
    return PassEnd::kRejected;
  }
  told_.end_potential_j = end_j_;
  told_.residual_n = law_.left_over_n(&step_);
  law_.accept(step_, true);
  return PassEnd::kMoved;
}

/// The motion that the bodies mostly share: that of the stiffest one's goal, where it is one that
/// pushes the others and has kept up. Rows are linear in what a body moves beyond that, so that
/// what is carried along in a turn is not felt as moving.
void BodyLaw::carry_all(std::uint32_t number) noexcept {
  const auto stiffer = [](const Body& one, const Body& other) {
    return one.is.spring.k_t_n_per_m < other.is.spring.k_t_n_per_m;
  };
  const Body& first = *std::max_element(bodies().begin(), bodies().end(), stiffer);
  BodyMotion way = first.goal_way;
  const Real turn2 = way.rotation_rad.squaredNorm();
  const Real most_rad = parameters_.scale.turn_rad;
  const Real behind2 = (first.error.rotation_rad - way.rotation_rad).squaredNorm();
  const bool turns = number == 0 && !first.is.is_held_back && turn2 > 0 &&
                     turn2 <= most_rad * most_rad && behind2 <= turn2 / 4;
  if (!turns) way = BodyMotion{};
  const Mat3 turn = so3_exp(way.rotation_rad).toRotationMatrix();
  for (Body& body : bodies()) {
    const Vec3 from = body.p.x0_w - first.p.x0_w;
    body.carry = way;
    if (turns) body.carry.translation_m += turn * from - from;
  }
}

/// Weights of the blocks, and what the pairs may meet.
void BodyLaw::begin_pass(std::uint32_t number, ProxyTick& tick) noexcept {
  for (Body& body : bodies()) {
    body.error = pose_error(body.goal, body.p);
    body.secant = secant_spring(body.is.spring, body.error);
    body.weight = std::sqrt(body.secant.k_t_n_per_m / bodies_[0].is.spring.k_t_n_per_m);
  }
  carry_all(number);
  const auto carried = [](const Body& body, bool is_carried) {
    if (!is_carried) return BodyPair::Carried{body.p, BodyMotion{}, body.error};
    return BodyPair::Carried{moved(body.p, body.carry.translation_m, body.carry.rotation_rad),
                             body.carry, body.error};
  };
  for (BodyPair& pair : pairs_) {
    const Body &a = bodies_[pair.a()], &b = of_b(pair);
    // One that rests is carried by nobody, and what the other does against it is all of its motion.
    const bool is_carried = moves(pair.a()) && (!pair.has_b() || moves(pair.b()));
    pair.set_carried(carried(a, is_carried), carried(b, is_carried));
    const BodyMotion pull = pair.relative(a.error, b.error);
    pair.begin_pass(
        number, norm_of(pull.translation_m) + pair.radius_m() * norm_of(pull.rotation_rad), tick);
  }
}

/// Bodies that are in each other go apart, the softer one of two, for any goals.
void BodyLaw::lead_out(ProxyTick& tick) noexcept {
  std::array<BodyMotion, kMostMovingBodies> motion;
  for (BodyPair& pair : pairs_) {
    if (!pair.is_inside()) continue;
    const Vec3 way_w = pair.way_out_w(tick);
    const bool is_b_softer = pair.has_b() && bodies_[pair.b()].is.spring.k_t_n_per_m <
                                                 bodies_[pair.a()].is.spring.k_t_n_per_m;
    const bool moves_b = pair.has_b() && moves(pair.b()) && (is_b_softer || !moves(pair.a()));
    if (moves_b) {
      motion[pair.b()].translation_m -= way_w;
    } else {
      motion[pair.a()].translation_m += way_w;
    }
  }
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Real far_m = norm_of(motion[i].translation_m);
    const Body& body = bodies_[i];
    if (body.most_m < kUnbounded && far_m > body.way_left_m)
      motion[i].translation_m *= body.way_left_m / far_m;
  }
  const Step step = step_by(motion);
  for (BodyPair& pair : pairs_) set_step(pair, step);
  accept(step, false);
  moved_little_ = false;
  tick.limited = true;
}

BodyLaw::PassEnd BodyLaw::pass(std::uint32_t number, BodiesTick& told, ProxyTick& tick) noexcept {
  begin_pass(number, tick);
  const bool inside = std::any_of(pairs_.begin(), pairs_.end(),
                                  [](const BodyPair& pair) { return pair.is_inside(); });
  told.recovering = std::any_of(pairs_.begin(), pairs_.end(),
                                [](const BodyPair& pair) { return pair.is_recovering(); });
  tried_m_.fill(0);
  if (inside) {
    lead_out(tick);
    told.end_potential_j = sum_j();
    return PassEnd::kMoved;
  }
  return PassTry(*this, told, tick).run();
}

}  // namespace haptic
