// SPDX-License-Identifier: Apache-2.0
// The search of a pass of several bodies for a step that every pair of them certifies.
#include "rt_core/bodies/body_search.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {
namespace {

/// Rounds more for every further body: each may meet as much as one does.
constexpr std::uint32_t kRoundsOfBody = 4;
/// A step that is no more than this share of what was asked for has a program of its own.
constexpr Real kMuchShorter = 0.8_r;

std::uint32_t rounds_for(std::uint32_t bodies) noexcept {
  return kProxyRounds + kRoundsOfBody * (bodies - 1);
}

}  // namespace

std::uint32_t BodyLaw::most_rounds(std::uint32_t bodies) noexcept {
  return rounds_for(bodies) + kProxyRetries * kProxyRetryRounds;
}

BodyLaw::StepSearch::StepSearch(BodyLaw& law, ProxyTick& tick) noexcept
    : law_(law),
      tick_(tick),
      scale_(law.parameters_.scale),
      rounds_(most_rounds(law.count_)),
      tolerance_m_([&] {
        Real size = 0;
        for (const Body& body : law.bodies()) {
          size = std::max(size,
                          body.weight * (norm_of(body.error.translation_m) +
                                         body.secant.length_m * norm_of(body.error.rotation_rad)));
        }
        return std::max(1.0e-4_r * scale_.tolerance_m, 16 * kRealEpsilon * size);
      }()),
      retry_at_(rounds_for(law.count_)),
      most_rad_(scale_.turn_rad) {
  law.is_short_ = false;
}

/// The next tries are shorter ones, with the rows of the planes at p alone.
void BodyLaw::StepSearch::begin_retry() noexcept {
  const bool last = round_ + kProxyRetryRounds >= rounds_;
  Real longest = 0, radius_m = std::numeric_limits<Real>::max();
  for (const Body& body : law_.bodies()) {
    longest = std::max(longest, norm_of(body.error.translation_m));
    radius_m = std::min(radius_m, body.is.radius_m);
  }
  law_.is_short_ = last;
  most_m_ = last ? kLastTolerances * scale_.tolerance_m
                 : kRetryShare * std::clamp(longest, scale_.step_m, kRetrySteps * scale_.step_m);
  // A step that turned by less than it might have needs a shorter turn all the same.
  most_rad_ = last ? most_m_ / radius_m : kRetryShare * std::min(most_rad_, tried_rad_);
  retry_at_ += kProxyRetryRounds;
  far_rows_ = shared_ = goes_on_ = false;
  for (Body& body : law_.bodies()) body.share = 1;
  for (BodyPair& pair : law_.pairs_) pair.begin_retry(from_start_, last, tick_);
  from_start_ = false;
}

/// The rows of all pairs on the blocks of their bodies: z = weight (motion - error), both beyond
/// what all are carried by, a turn as a length.
void BodyLaw::StepSearch::push_rows() noexcept {
  law_.program_.clear();
  const auto scaled = [&](std::array<Real, 6>& g, const Body& body) {
    const Real along = 1 / body.weight, around = along / body.secant.length_m;
    for (std::size_t k = 0; k < 3; ++k) g[k] *= along;
    for (std::size_t k = 3; k < 6; ++k) g[k] *= around;
  };
  for (std::size_t k = 0; k < law_.pairs_.size(); ++k) {
    const BodyPair& pair = law_.pairs_[k];
    pair_begin_[k] = static_cast<std::uint16_t>(law_.program_.rows());
    for (std::uint32_t i = 0; i < pair.row_count(); ++i) {
      BlockRow row = law_.on_blocks(pair, pair.row(i));
      scaled(row.g_a, law_.bodies_[row.a]);
      if (row.b != kNoBlock) scaled(row.g_b, law_.bodies_[row.b]);
      if (!law_.program_.push(row)) {
        tick_.limited = true;
        break;
      }
    }
  }
  pair_begin_[law_.pairs_.size()] = static_cast<std::uint16_t>(law_.program_.rows());
}

/// Hands the solution back to the pairs, and to the bodies the motion that it asks for.
void BodyLaw::StepSearch::take_solution() noexcept {
  for (Body& body : law_.bodies()) body.is_touched = false;
  for (BodyPair& pair : law_.pairs_) pair.begin_found();
  const auto active = law_.program_.active();
  for (std::size_t k = 0; k < active.size(); ++k) {
    std::size_t at = 0;
    while (at + 1 < law_.pairs_.size() && active[k] >= pair_begin_[at + 1]) ++at;
    BodyPair& pair = law_.pairs_[at];
    pair.add_active(active[k] - pair_begin_[at], law_.program_.multipliers()[k]);
    law_.bodies_[pair.a()].is_touched = true;
    if (pair.has_b()) law_.bodies_[pair.b()].is_touched = true;
  }
  for (std::uint32_t i = 0; i < law_.count_; ++i) {
    Body& body = law_.bodies_[i];
    const auto& z = law_.program_.z(i);
    BodyMotion more = beyond(body.pull, body.carry);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto c = static_cast<Eigen::Index>(k);
      more.translation_m[c] += z[k] / body.weight;
      more.rotation_rad[c] += z[3 + k] / (body.weight * body.secant.length_m);
    }
    body.wish = joined(body.carry, more);
  }
  for (BodyPair& pair : law_.pairs_)
    pair.end_found(law_.bodies_[pair.a()].wish, law_.of_b(pair).wish);
}

/// `goes_on`: rows have only been added since the last program, whose active rows hold most of this
/// one's solution.
void BodyLaw::StepSearch::solve_rows(bool goes_on) noexcept {
  push_rows();
  std::array<std::uint16_t, kMostMovingBodies * kBlockSize> first;
  std::size_t count = 0;
  for (std::size_t k = 0; goes_on && k < law_.pairs_.size(); ++k) {
    for (const std::uint8_t row : law_.pairs_[k].active_rows()) {
      if (count < first.size()) first[count++] = static_cast<std::uint16_t>(pair_begin_[k] + row);
    }
  }
  law_.program_.solve(tolerance_m_, std::span(first).first(count));
  ProxyWork& work = tick_.work;
  work.rows = std::max(work.rows, law_.program_.rows());
  work.qp_iterations = std::max(work.qp_iterations, law_.program_.steps());
  work.qp_programs += law_.program_.programs();
  work.qp_steps += law_.program_.steps();
  work.search_work += law_.program_.more_units();
  if (law_.program_.capped()) tick_.limited = true;
  take_solution();
}

/// Adds half spaces of cones until the solution keeps all of them.
void BodyLaw::StepSearch::cut_cones() noexcept {
  for (; cone_programs_ < kMaxConePrograms; ++cone_programs_) {
    bool cut = false;
    for (BodyPair& pair : law_.pairs_) cut = pair.cut_cones(tolerance_m_) || cut;
    if (!cut) return;
    if (!law_.has_budget(tick_) && cone_programs_ >= kGrantedConePrograms) {
      tick_.limited = true;
      return;
    }
    solve_rows(true);
  }
}

bool BodyLaw::StepSearch::shifts_fit(bool may_lift) const noexcept {
  return std::all_of(law_.pairs_.begin(), law_.pairs_.end(), [&](const BodyPair& pair) {
    return !pair.has_cones() || pair.shifts_fit(may_lift);
  });
}

/// Shifts the cones until each has the slip that its program finds. Where that does not end a point
/// may be lifted, but none sinks: then no cone is shifted.
void BodyLaw::StepSearch::settle_cones() noexcept {
  const bool some = std::any_of(law_.pairs_.begin(), law_.pairs_.end(),
                                [](const BodyPair& pair) { return pair.has_cones(); });
  if (!some) return;
  cut_cones();
  for (std::uint32_t k = 0;; ++k) {
    const bool ends = k == kMaxShiftsOfRound || shift_programs_ >= kMaxShiftPrograms ||
                      (k > 0 && !law_.has_budget(tick_));
    if (shifts_fit(ends)) return;
    if (ends) tick_.limited = true;
    for (BodyPair& pair : law_.pairs_) {
      if (pair.has_cones()) pair.shift_cones(ends);
    }
    shift_programs_ += 1;
    solve_rows(true);
    cut_cones();
    if (ends) return;
  }
}

void BodyLaw::StepSearch::solve() noexcept {
  for (Body& body : law_.bodies()) {
    body.pull = body.error;
    body.pull_share = 1;
  }
  set_pulls();
  solve_rows(goes_on_);
  settle_cones();
  goes_on_ = true;
  if (far_rows_) return;
  free_motion_m_ = motion_m();
  residual_n_ = law_.left_over_n(nullptr);
}

void BodyLaw::StepSearch::set_pulls() noexcept {
  for (BodyPair& pair : law_.pairs_)
    pair.set_pull(law_.bodies_[pair.a()].pull, law_.of_b(pair).pull);
}

/// The program again for the part of the errors that the step goes, where it is much shorter than
/// asked for: of a solution only a share is taken, and with it of what a row asks for beyond its
/// gap. False: it is not.
bool BodyLaw::StepSearch::solve_shorter() noexcept {
  bool is_shorter = false;
  for (std::uint32_t i = 0; i < law_.count_; ++i) {
    Body& body = law_.bodies_[i];
    body.pull_share = body.is_touched && s_[i] > 0 ? s_[i] : Real{1};
    is_shorter = is_shorter || body.pull_share < kMuchShorter;
  }
  if (!is_shorter || !law_.has_budget(tick_)) {
    for (Body& body : law_.bodies()) body.pull_share = 1;
    return false;
  }
  for (Body& body : law_.bodies()) {
    const Real s = body.pull_share;
    body.pull = {s * body.error.translation_m, s * body.error.rotation_rad};
  }
  set_pulls();
  solve_rows(true);
  settle_cones();
  if (!far_rows_) free_motion_m_ = motion_m();
  return true;
}

/// The longest of the motions that the program asks for.
Real BodyLaw::StepSearch::motion_m() const noexcept {
  Real most_m = 0;
  for (const Body& body : law_.bodies()) {
    most_m = std::max(most_m, norm_of(body.wish.translation_m) +
                                  body.is.radius_m * norm_of(body.wish.rotation_rad));
  }
  return most_m;
}

/// The part of what the program asks for that may be tried of each pair's relative motion with
/// something near; false: a list has been outrun, and the bodies wait for the next one.
bool BodyLaw::StepSearch::bound_by_pairs() noexcept {
  tried_rad_ = 0;
  for (std::size_t k = 0; k < law_.pairs_.size(); ++k) {
    BodyPair& pair = law_.pairs_[k];
    const BodyMotion way = pair.relative(law_.bodies_[pair.a()].wish, law_.of_b(pair).wish);
    const Real far_m = norm_of(way.translation_m), turn_rad = norm_of(way.rotation_rad);
    const Real motion_m = far_m + turn_rad * pair.radius_m();
    Real s = 1;
    if (motion_m > pair.nearest_m()) {
      if (far_m > most_m_) s = most_m_ / far_m;
      if (s * turn_rad > most_rad_) s = most_rad_ / turn_rad;
      s = std::max(s, pair.nearest_m() / motion_m);
      tried_rad_ = std::max(tried_rad_, s * turn_rad);
    }
    const Real trust_m = pair.trusted_m(s, way, tick_);
    if (pair.has_facets() && motion_m > trust_m && !(trust_m > scale_.still_m)) return false;
    if (s * motion_m > trust_m) {
      s = trust_m / motion_m;
      cut_ = true;
    }
    law_.tried_m_[k] = s * motion_m;
    if (law_.moves(pair.a())) s_[pair.a()] = std::min(s_[pair.a()], s);
    if (pair.has_b() && law_.moves(pair.b())) s_[pair.b()] = std::min(s_[pair.b()], s);
  }
  return true;
}

/// And what each body may move by in this tick; those of one island go the same share.
void BodyLaw::StepSearch::bound_by_tick() noexcept {
  for (std::uint32_t i = 0; i < law_.count_; ++i) {
    const Body& body = law_.bodies_[i];
    const Real far_m = norm_of(body.wish.translation_m);
    const Real turn_rad = norm_of(body.wish.rotation_rad);
    const Real s = s_[i];
    // Place and turn are bounded each by itself, but where planes tie them together.
    s_turn_[i] = s * turn_rad > body.turn_left_rad ? body.turn_left_rad / turn_rad : s;
    s_[i] = s * far_m > body.way_left_m ? body.way_left_m / far_m : s;
    cut_ = cut_ || s_turn_[i] < s || s_[i] < s;
    if (body.is_touched) s_[i] = s_turn_[i] = std::min(s_[i], s_turn_[i]);
    s_[i] *= body.share;
    s_turn_[i] *= body.share;
  }
  for (std::uint32_t i = 0; i < law_.count_; ++i) {
    if (!law_.bodies_[i].is_touched) continue;
    const std::uint32_t first = law_.program_.island_of(i);
    s_[first] = std::min(s_[first], s_[i]);
  }
  for (std::uint32_t i = 0; i < law_.count_; ++i) {
    if (law_.bodies_[i].is_touched) s_[i] = s_turn_[i] = s_[law_.program_.island_of(i)];
  }
}

/// Two bodies that are near each other and go different shares of what they should do together move
/// against each other: no farther than one of them may by itself.
void BodyLaw::StepSearch::bound_together() noexcept {
  for (std::uint32_t round = 1; round < law_.count_; ++round) {
    bool changed = false;
    for (std::size_t k = 0; k < law_.pairs_.size(); ++k) {
      const BodyPair& pair = law_.pairs_[k];
      const std::uint32_t a = pair.a(), b = pair.b();
      if (!pair.has_b() || !law_.moves(a) || !law_.moves(b)) continue;
      if (s_[a] == s_[b] && s_turn_[a] == s_turn_[b]) continue;
      const auto going = [&](std::uint32_t i) {
        const BodyMotion& wish = law_.bodies_[i].wish;
        return BodyMotion{s_[i] * wish.translation_m, s_turn_[i] * wish.rotation_rad};
      };
      const BodyMotion way = pair.relative(going(a), going(b));
      const Real far_m = norm_of(way.translation_m), turn_rad = norm_of(way.rotation_rad);
      const Real motion_m = far_m + turn_rad * pair.radius_m();
      const bool meets = motion_m > std::max(pair.nearest_m(), law_.tried_m_[k]);
      if (!meets || (far_m <= most_m_ && turn_rad <= most_rad_)) continue;
      s_[a] = s_[b] = std::min(s_[a], s_[b]);
      s_turn_[a] = s_turn_[b] = std::min(s_turn_[a], s_turn_[b]);
      changed = cut_ = true;
    }
    if (!changed) return;
  }
}

/// The step of this round; false: the bodies wait for a list.
bool BodyLaw::StepSearch::choose_step(Step& step) noexcept {
  s_.fill(1);
  cut_ = false;
  if (!bound_by_pairs()) return false;
  bound_by_tick();
  bound_together();
  std::array<BodyMotion, kMostMovingBodies> motion;
  for (std::uint32_t i = 0; i < law_.count_; ++i) {
    const BodyMotion& wish = law_.bodies_[i].wish;
    motion[i] = {s_[i] * wish.translation_m, s_turn_[i] * wish.rotation_rad};
  }
  step = law_.step_by(motion);
  // Nothing holds the body: it arrives to the bit, and the pull is exactly zero.
  for (std::uint32_t i = 0; i < law_.count_; ++i) {
    const Body& body = law_.bodies_[i];
    const bool arrives = s_[i] == 1 && s_turn_[i] == 1 && !body.is_touched;
    if (arrives && body.pull.translation_m == body.error.translation_m &&
        body.pull.rotation_rad == body.error.rotation_rad) {
      step.q[i] = body.goal;
    }
  }
  return true;
}

bool BodyLaw::StepSearch::shares_are_whole() const noexcept {
  return std::all_of(law_.bodies().begin(), law_.bodies().end(),
                     [](const Body& body) { return body.share == 1; });
}

/// A step is certified: it is the one, or a nearer one is tried, with planes chosen from the start.
BodyLaw::StepSearch::Round BodyLaw::StepSearch::take_certified(bool still) noexcept {
  const bool held_back = far_rows_ && motion_m() < kHeldBack * free_motion_m_;
  if (cut_ || (!still && !held_back)) return Round::kFound;
  if (!shares_are_whole()) return still ? Round::kNone : Round::kFound;
  bool crowded = false, due = false, rests = false;
  for (BodyPair& pair : law_.pairs_) {
    crowded = crowded || pair.is_crowded();
    rests = rests || pair.rests_on_friction();
    due = pair.choice_is_due() || due;
  }
  const bool held_far = far_rows_ || crowded;
  if (!held_far && (chosen_short_ || rests || !due)) return Round::kFound;
  if (retry_at_ >= rounds_) return Round::kFound;
  law_.remember_active();
  if (!held_far) retry_at_ = rounds_ - kProxyRetryRounds;
  round_ = retry_at_ - 1;
  from_start_ = chosen_short_ = true;
  return Round::kNext;
}

/// Imposes the plane that a step lacks most.
BodyLaw::StepSearch::Round BodyLaw::StepSearch::impose_lacking(const Check& result) noexcept {
  BodyPair& pair = law_.pairs_[result.worst];
  const Real least_share = nearer_ < kMostNearer ? kNearerShare : kLeastRoom;
  Real share = 1;
  const Real taken = s_[law_.mover_of(pair)];
  if (!pair.impose_lacking(-scale_.tolerance_m / 2, taken, least_share, share, tick_))
    return Round::kNone;
  if (share < 1) {
    law_.shorten(pair, share);
    shared_ = true;
    nearer_ += 1;
    return Round::kNext;
  }
  far_rows_ = far_rows_ || pair.has_far_rows();
  for (Body& body : law_.bodies()) body.share = 1;
  shared_ = false;
  return Round::kNext;
}

bool BodyLaw::StepSearch::run(Step& step) noexcept {
  for (Body& body : law_.bodies()) body.share = 1;
  for (; round_ < rounds_; ++round_) {
    if (round_ == retry_at_) begin_retry();
    spent_ = law_.round_grants_ > 0 && !law_.has_budget(tick_);
    law_.round_grants_ += 1;
    if (spent_) return false;
    tick_.work.rounds = std::max(tick_.work.rounds, round_ + 1);
    if (!shared_) solve();
    spent_ = !choose_step(step);
    if (!spent_ && !shared_ && solve_shorter()) spent_ = !choose_step(step);
    if (spent_) return false;
    const Check result = law_.check(step, -scale_.tolerance_m / 2, round_ > 0, tick_);
    spent_ = result.spent;
    if (spent_) return false;
    const bool still = law_.is_still(step) || (result.ok && law_.gains_nothing(step));
    if (result.ok) {
      const Round end = take_certified(still);
      if (end != Round::kNext) return end == Round::kFound;
    } else if (!(result.lacking_m > 0)) {
      if (still) return false;
      shared_ = true;  // check() has cut the shares of the bodies whose way dips
    } else if (impose_lacking(result) == Round::kNone) {
      break;
    }
  }
  tick_.limited = true;
  return false;
}

}  // namespace haptic
