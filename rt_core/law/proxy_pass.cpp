// SPDX-License-Identifier: Apache-2.0
// One pass of the proxy: which planes to impose, and a step that every pair certifies.
#include <algorithm>
#include <array>
#include <cmath>

#include "rt_core/base/rotation.hpp"
#include "rt_core/law/proxy_step.hpp"

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
/// Passes after which the planes of a part at rest are chosen from the start again.
constexpr std::uint32_t kChoiceAge = 96;
/// The same where they are others than those chosen last.
constexpr std::uint32_t kNewChoiceAge = 16;

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
  if (is_fixed()) {
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
  close_m_ = closes ? scale.tolerance_m : 0;
  far_rows_ = false;
  impose_last(error, tick);

  const Real limit_j = tick.recovering ? std::numeric_limits<Real>::max()
                       : closes        ? start_j + gained_j
                                       : start_j - least_fall_j(start_j);
  Real end_j = start_j;
  const auto affordable = [&](const Step& step) {
    end_j = potential_j(spring, error_of(goal, step.q));
    return end_j <= limit_j;
  };

  Step step;
  const bool found = solve(error, step, tick);
  if (tick.spent) return end_spent();
  tick.residual_n = left_over_n(near_wish_, Vec3::Zero(), Vec3::Zero());
  bool ok = found && affordable(step);
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
    const Real most = std::min(scale.step_m, way_left_m_);
    const Real s = far > most ? most / far : Real{1};
    way = step_by(s * error.translation_m, Vec3::Zero());
    return correct(way, tick) && affordable(way);
  };
  if (ok && short_ && !is_fixed() && cones_.empty() && has_budget(tick)) {
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
  if (!ok) ok = correct(step, tick) && affordable(step);
  if (tick.spent) return end_spent();
  if (!ok) {
    const Vec3 dx = step.dx_m, dtheta = step.dtheta_rad;
    Real share = 0.5_r;
    for (std::uint32_t k = 0; k < kMaxBackOffs && !ok; ++k, share /= 2) {
      if (!may_begin(kRoundGrant, tick)) return end_spent();
      step = step_by(share * dx, share * dtheta);
      ok = check(step, kCorrectedShare * -scale.tolerance_m, tick).ok && affordable(step);
    }
  }
  if (!ok) ok = without_turn(step);
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

/// Imposes the planes that held the proxy last, where they are C-faces still, and those of pairs in
/// recovery.
void Proxy::impose_last(const PoseError& error, ProxyTick& tick) noexcept {
  for (const ImposedPlane& last : active_) pairs_[last.pair].held_in = pass_;
  for (const ReachedPair& reached : reached_) {
    const ProxyPair& pair = pairs_[reached.pair];
    if (!pair.inside && pair.held_in != pass_) continue;
    const auto take = [&](const PlaneId& id, SupportPair support) {
      const PlaneRegion& region = region_at_p(reached.pair, id, support, tick);
      if (!region.gap.defined) return;
      // Past the end of what it held, another plane may certify the pair: let the step tell.
      if (!pair.inside && (!region.overlap || region.gap.gap_m < -valid_depth(parameters_.scale))) {
        return;
      }
      ImposedPlane plane;
      plane.pair = reached.pair;
      plane.id = id;
      plane.allowed_m = reached.allowed_m;
      plane.at_start = true;
      if (!imposed_.push(plane) || !add_region(imposed_.size() - 1, region, error)) {
        tick.limited = true;
      }
    };
    if (pair.inside) {
      take(pair.plane, pair.support);
      continue;
    }
    // Planes that never turn are soon found again; none may hold the proxy beyond its C-face.
    if (is_fixed() || choose_from_start_) continue;
    for (const ImposedPlane& last : active_) {
      if (last.pair == reached.pair && plane_applies(*pair.view, p_.r_wa, last.id)) {
        take(last.id, last.support);
      }
    }
  }
  choose_from_start_ = false;
  impose_pending(error, tick);
}

/// Imposes what a pass at this p found before it ended for want of budget: the planes at p, and at
/// the steps that showed them to be needed there too.
void Proxy::impose_pending(const PoseError& error, ProxyTick& tick) noexcept {
  for (const ImposedPlane& plane : pending_) {
    if (is_imposed(plane.pair, plane.id)) continue;
    if (!imposed_.push(plane)) break;
    ImposedPlane& taken = imposed_[imposed_.size() - 1];
    taken.times = 1;
    taken.at_start = true;
    taken.at_step = false;
    if (!add_rows_at_p(imposed_.size() - 1, error, tick)) tick.limited = true;
  }
  std::uint32_t steps = 0;
  for (std::uint32_t k = pending_.size(); k-- > 0;) {
    const ImposedPlane& plane = pending_[k];
    if (!plane.at_step) continue;
    if (steps >= kGrantedSteps && !has_budget(tick)) break;
    for (std::uint32_t at = 0; at < imposed_.size(); ++at) {
      ImposedPlane& taken = imposed_[at];
      if (taken.pair != plane.pair || !(taken.id == plane.id)) continue;
      steps += 1;
      far_rows_ = taken.at_step = true;
      taken.dx_m = plane.dx_m;
      taken.dtheta_rad = plane.dtheta_rad;
      taken.times = plane.times;
      const Step step = step_by(plane.dx_m, plane.dtheta_rad);
      if (!add_rows(at, step, error, plane.times > 1, tick)) tick.limited = true;
    }
  }
}

bool Proxy::is_imposed(std::uint32_t pair, const PlaneId& id) const noexcept {
  return std::any_of(imposed_.begin(), imposed_.end(), [&](const ImposedPlane& plane) {
    return plane.pair == pair && plane.id == id;
  });
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

/// Whether two planes of one pair are imposed: one of them may be more than the pair needs.
bool Proxy::crowded() const noexcept {
  for (std::uint32_t k = 0; k < imposed_.size(); ++k) {
    for (std::uint32_t l = 0; l < k; ++l) {
      if (imposed_[k].pair == imposed_[l].pair) return true;
    }
  }
  return false;
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
  short_ = false;
  bound_programs_ = 0;
  const Real least_m = -scale.tolerance_m / 2;
  std::uint32_t nearer = 0;               // tries of a part of the step
  bool chosen_short = false;              // planes chosen from the start, for a short step
  std::uint32_t retry_at = kProxyRounds;  // round at which the next retry starts
  for (std::uint32_t round = 0; round < kRounds; ++round) {
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
      cut_cones(error, tolerance, tick);
      if (last_qp_.capped) tick.limited = true;
      wish_ = asked(error);
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
      if (has_long_lists()) trust_m = std::min(trust_m, kListShare * unlisted_m());
      // The list has been outrun: the part waits for the next one.
      if (motion > trust_m && !(trust_m > scale.still_m)) {
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
    const Check result = check(step, least_m, tick);
    if (tick.spent) return chosen_short && stay_still(step, tick);
    const bool still = is_still(step) || (result.ok && gains_nothing(step, tick));
    if (result.ok) {
      if (cut || (!still && !(far_rows_ && motion < kHeldBack * free_motion))) return true;
      if (share < 1) return !still;
      // Rows linearised at a far step, planes that were the best there, and planes of an earlier
      // pass can hold the proxy where it is: a nearer step, with planes chosen from the start, may
      // be free.
      const bool held_far = far_rows_ || crowded();
      if (!held_far && (chosen_short || !choice_is_due())) return true;
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
        pairs_[lacking.pair].view->has_skin() && lacking.gap_m > scale.tolerance_m;
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
PoseError Proxy::asked(const PoseError& error) const noexcept {
  PoseError wish;
  wish.translation_m = last_qp_.z.head<3>() + error.translation_m;
  if (!is_fixed()) {
    wish.rotation_rad = last_qp_.z.tail<3>() / secant_.length_m + error.rotation_rad;
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
  if (held_ == 0 || tick.recovering || close_m_ > 0) return false;
  const Real end_j = potential_j(parameters_.spring, error_of(goal_, step.q));
  return tick.end_potential_j - end_j < kIdleShare * tick.end_potential_j;
}

bool Proxy::is_still(const Step& step) const noexcept {
  const ProxyScale& scale = parameters_.scale;
  return step.dx_m.squaredNorm() <= scale.still_m * scale.still_m &&
         step.dtheta_rad.squaredNorm() <= scale.still_rad * scale.still_rad;
}

/// Whether the planes that hold the proxy where it is must be chosen from the start to be sure: the
/// goal rests, or the last choice is long ago, sooner where they are others than then.
bool Proxy::choice_is_due() noexcept {
  std::uint64_t planes = 0;
  for (const ImposedPlane& plane : imposed_) {
    const std::uint64_t id = std::uint64_t{plane.id.i} << 19 | std::uint64_t{plane.id.j} << 3 |
                             static_cast<std::uint64_t>(plane.id.type) << 1 |
                             (plane.id.flipped ? 1u : 0u);
    planes = (planes ^ (std::uint64_t{plane.pair} << 35 | id)) * 0x9e3779b97f4a7c15u;
  }
  const std::uint32_t age = planes != chosen_planes_ ? kNewChoiceAge : kChoiceAge;
  const bool due = held_ > 0 || chosen_ago_ >= age;
  chosen_ago_ = due ? 0 : chosen_ago_ + 1;
  chosen_planes_ = planes;
  return due;
}

/// Whether the features of the plane that came closest to certifying a pair of facets touch, or
/// would along it: at p, or at the end of `step`. Not asked of others.
bool Proxy::meets(const ReachedPair& reached, const Step* step, ProxyTick& tick) noexcept {
  const ProxyPair& pair = pairs_[reached.pair];
  if (!pair.view->has_skin() || pair.inside) return true;
  // Not where the features lie over each other elsewhere, but where the pieces are nearest.
  const auto touches = [&](const PlaneRegion& region) {
    const Real most_m = region.gap.gap_m + parameters_.scale.tolerance_m;
    return region.overlap &&
           std::any_of(region.points.begin(), region.points.begin() + region.count,
                       [&](const ManifoldPoint& point) { return point.gap_m <= most_m; });
  };
  if (step == nullptr) {
    const PlaneRegion& at_p = region_at_p(reached.pair, reached.plane, reached.support, tick);
    return at_p.gap.defined && touches(at_p);
  }
  PlaneRegion at_q;
  at_q.gap = gap_at(pair, *step, reached.plane, reached.support, tick);
  if (!at_q.gap.defined) return false;
  find_region(pair, step->q, at_q, tick);
  return touches(at_q);
}

/// Of the pairs that a step lacks the one whose plane is to be imposed: of the first few, in the
/// order of what they lack, the first that meets at p, or where none does at the step's end; those
/// that follow another pair come last. None: the length of the list.
std::uint32_t Proxy::worst_that_meets(const Check& check, const Step& step, Real least_m,
                                      ProxyTick& tick) noexcept {
  if (!pairs_[reached_[check.worst].pair].view->has_skin()) return check.worst;
  for (const bool follow : {false, true}) {
    std::array<std::uint32_t, kMaxMeetingLooks> worst;
    std::uint32_t count = 0;
    std::uint32_t last = reached_.size();
    while (count < worst.size()) {
      std::uint32_t next = reached_.size();
      const auto gap_m = [&](std::uint32_t k) {
        return reached_[k].gap_q_m + reached_[k].allowed_m;
      };
      const auto is_before = [&](std::uint32_t k, std::uint32_t other) {
        return gap_m(k) < gap_m(other) || (gap_m(k) == gap_m(other) && k < other);
      };
      for (std::uint32_t k = 0; k < check.checked; ++k) {
        const ReachedPair& reached = reached_[k];
        if (!reached.exact_q || !(gap_m(k) < least_m) || reached.follows() != follow) continue;
        if (last < reached_.size() && !is_before(last, k)) continue;
        if (next == reached_.size() || is_before(k, next)) next = k;
      }
      if (next == reached_.size()) break;
      if (meets(reached_[next], nullptr, tick)) return next;
      worst[count++] = last = next;
    }
    for (std::uint32_t k = 0; k < count; ++k) {
      if (meets(reached_[worst[k]], &step, tick)) return worst[k];
    }
  }
  return reached_.size();
}

/// Adds the plane that came closest to certifying the pair of this number in the list: at p, and
/// when that was not enough at the step.
bool Proxy::impose(std::uint32_t number, const Step& step, const PoseError& error,
                   ProxyTick& tick) noexcept {
  const ReachedPair& reached = reached_[number];
  std::uint32_t at = 0;
  while (at < imposed_.size() &&
         !(imposed_[at].pair == reached.pair && imposed_[at].id == reached.plane)) {
    ++at;
  }
  if (at == imposed_.size()) {
    ImposedPlane plane;
    plane.pair = reached.pair;
    plane.id = reached.plane;
    plane.support = reached.support;
    plane.allowed_m = reached.allowed_m;
    if (short_) take_touching(reached, plane, tick);
    if (!imposed_.push(plane)) return false;
  }
  ImposedPlane& plane = imposed_[at];
  if (plane.id == reached.plane) plane.support = reached.support;
  plane.times += 1;
  if (!plane.at_start) {
    plane.at_start = true;
    // These alone at first: the step that they replace may lie so far ahead that its own rows would
    // ask for more than the plane does.
    const std::uint32_t rows = rows_.size();
    if (!add_rows_at_p(at, error, tick)) return false;
    if (rows_.size() > rows) return true;
  }
  far_rows_ = plane.at_step = true;
  plane.dx_m = step.dx_m;
  plane.dtheta_rad = step.dtheta_rad;
  return add_rows(at, step, error, plane.times > 1, tick);
}

/// Of the planes of a pair that certify it at p, one whose features touch there, where the one that
/// came closest at the step would hold the part past the end of its features.
void Proxy::take_touching(const ReachedPair& reached, ImposedPlane& plane,
                          ProxyTick& tick) noexcept {
  const ProxyPair& pair = pairs_[reached.pair];
  if (is_fixed() || pair.inside || reached.gap_p_m > parameters_.scale.tolerance_m) return;
  const auto touches = [&](const PlaneId& id, SupportPair support) {
    const PlaneRegion& region = region_at_p(reached.pair, id, support, tick);
    return region.gap.defined && region.overlap;
  };
  if (touches(plane.id, plane.support)) return;
  const std::uint32_t looked_at = std::min(reached.exposed_count, kMaxTouchingLooks);
  for (std::uint32_t k = 0; k < looked_at; ++k) {
    const ValidPlane& valid = valid_[reached.valid_begin + k];
    if (valid.gap_m > parameters_.scale.tolerance_m || is_imposed(reached.pair, valid.id)) continue;
    if (!touches(valid.id, valid.support)) continue;
    plane.id = valid.id;
    plane.support = valid.support;
    return;
  }
}

/// Planes with a multiplier: the next pass starts with them.
void Proxy::remember_active() noexcept {
  if (keeps_active_) return;
  active_.clear();
  for (std::uint32_t k = 0; k < last_qp_.active_count; ++k) {
    const std::uint32_t at = row_plane_[last_qp_.active[k]];
    if (at >= imposed_.size()) continue;  // what p may move by
    const ImposedPlane& plane = imposed_[at];
    bool known = false;
    for (const ImposedPlane& other : active_) {
      known = known || (other.pair == plane.pair && other.id == plane.id);
    }
    if (!known) static_cast<void>(active_.push(plane));
  }
}

}  // namespace haptic
