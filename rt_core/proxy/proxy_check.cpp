// SPDX-License-Identifier: Apache-2.0
// What certifies a step of the proxy: a plane of every near pair that has a gap at its end, and the
// correction of a step that misses one by little.
#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/base/rotation.hpp"
#include "rt_core/proxy/proxy_step.hpp"
#include "rt_core/proxy/way_gap.hpp"

namespace haptic {
namespace {

/// By so much of the tolerance the rounding of a program may deepen a gap that is to stay.
constexpr Real kKeptShare = 1.0e-3_r;
/// A step is not shortened by more than this at once.
constexpr Real kLeastShare = 1.0e-3_r;
/// Roundings of how far a pair's vertices move along a direction, in those of the whole motion.
constexpr Real kHeldRounding = 16;
/// Of the pairs that lack a plane by their own so many are looked at in the order of what they
/// lack, the worst first; and pairs that count as one unit when the next one is picked.
constexpr std::uint32_t kMostPicks = 16, kPickedOfUnit = 128;
/// Seats of a round in which none is free that count as one unit.
constexpr std::uint32_t kSeatsOfUnit = 8;
/// A step for whose pairs there are no slots is shortened to this share.
constexpr Real kRefusedShare = 0.25_r;

/// How deep a step may dip on its way, from a gap of `gap_p_m`: among facets, which a skin holds
/// apart, deeper than that by rounding, where it is below the tolerance.
Real deepest_on_way(const ProxyScale& scale, Real gap_p_m, bool has_facets) noexcept {
  const Real rounding_m = has_facets ? kKeptShare * scale.tolerance_m : Real{0};
  return std::min(-scale.tolerance_m, gap_p_m - rounding_m);
}

}  // namespace

/// Lower bound of the gap of a pair on the way of `step`, from its gaps along directions at both
/// ends.
Real Proxy::path_gap(const ProxyPair& pair, const DirectionGap& at_p, const DirectionGap& at_q,
                     const Step& step) const noexcept {
  return gap_on_way_m({at_p.normal_w, at_q.normal_w, at_p.gap_m, at_q.gap_m}, pair.reach_a_m,
                      step.dx_m, step.dtheta_rad);
}

/// The same along one plane of the pair.
Real Proxy::path_gap(const ProxyPair& pair, Real gap_p_m, const PlaneGap& at_q,
                     const Step& step) const noexcept {
  if (is_locked() || step.dtheta_rad.isZero(0)) return std::min(gap_p_m, at_q.gap_m);
  const bool turns = at_q.id.type != ContactType::kB;
  const Vec3 at_p = turns ? plane_normal(pair_at(pair, part_.pose), at_q.id) : at_q.normal_w;
  return path_gap(pair, DirectionGap{at_p, gap_p_m, {}},
                  DirectionGap{at_q.normal_w, at_q.gap_m, {}}, step);
}

/// Of the normals of the planes imposed in this pass, one that separates a pair of facets at the
/// end of the step and dips least on the way there: where no plane of its own separates it from one
/// end of the step to the other, since a part slides off a facet along its plane, and past the next
/// one, which is no plane of that one's.
Proxy::SharedGap Proxy::shared_gap(ReachedPair& reached, const Step& step, Real least_m,
                                   ProxyTick& tick) const noexcept {
  SharedGap best;
  const ProxyPair& pair = near_.pairs[reached.pair];
  if (!pair.view->has_facet()) return best;
  const Real least_valid = -valid_depth(parameters_.scale);
  std::uint32_t asked = 0;
  for (const ImposedPlane& imposed : program_.imposed) {
    if (imposed.pair == reached.pair) continue;
    if (asked++ == kMaxSharedDirections) break;
    const ProxyPair& other = near_.pairs[imposed.pair];
    const auto gap_at = [&](const GripPose& pose) {
      tick.work.plane_gaps += 1;
      return direction_gap(pair_at(pair, pose), plane_normal(pair_at(other, pose), imposed.id),
                           reached.support);
    };
    const DirectionGap at_q = gap_at(step.q);
    if (!(at_q.gap_m > reached.shared_m)) continue;
    const DirectionGap at_p = gap_at(part_.pose);
    if (!(at_p.gap_m >= least_valid)) continue;
    reached.shared_m = at_q.gap_m;
    if (!(at_q.gap_m >= least_m)) continue;
    const Real path_m = path_gap(pair, at_p, at_q, step);
    const Real worth_m = path_m - deepest_on_way(parameters_.scale, at_p.gap_m, has_facets());
    if (!(worth_m > best.worth_m)) continue;
    best = {at_p.gap_m, at_q.gap_m, path_m, worth_m, at_q.normal_w};
    if (worth_m >= 0) break;
  }
  return best;
}

/// What a plane of a reached pair, with its gap at p, is worth at a step: its gap at the end, and
/// on the way there.
Proxy::PlaneWorth Proxy::worth_of(const ReachedPair& reached, const ValidPlane& plane,
                                  const Step& step, Real least_m, ProxyTick& tick) const noexcept {
  const ProxyPair& pair = near_.pairs[reached.pair];
  constexpr Real kLowest = -std::numeric_limits<Real>::max();
  const Real gap_p_m = plane.gap_m;
  PlaneWorth found{plane.id, {}, gap_p_m, kLowest, kLowest, kLowest, {}};
  const PlaneGap gap = plane_gap(pair_at(pair, step.q), plane.id, plane.support);
  tick.work.plane_gaps += 1;
  found.support = gap.support;
  found.normal_q_w = gap.normal_w;
  if (!gap.defined) return found;
  found.gap_q_m = found.path_m = gap.gap_m;
  found.worth_m = gap.gap_m - least_from(least_m, gap_p_m);
  if (found.worth_m < 0) return found;
  found.path_m = path_gap(pair, gap_p_m, gap, step);
  found.worth_m = std::min(found.worth_m,
                           found.path_m - deepest_on_way(parameters_.scale, gap_p_m, has_facets()));
  return found;
}

void Proxy::take_plane(ReachedPair& reached, const PlaneWorth& plane) noexcept {
  reached.plane = plane.id;
  reached.support = plane.support;
  reached.gap_p_m = plane.gap_p_m;
  reached.gap_q_m = plane.gap_q_m;
  reached.path_m = plane.path_m;
  reached.normal_q_w = plane.normal_q_w;
}

/// What a gap may be at the end of a step that may end with `least_m`: where it is less at p, after
/// a correction, it need not grow, since rows that asked for that would raise the energy. It never
/// comes below the tolerance.
Real Proxy::least_from(Real least_m, Real gap_p_m) const noexcept {
  const Real tolerance_m = parameters_.scale.tolerance_m;
  return std::min(least_m, std::max(gap_p_m - kKeptShare * tolerance_m, -tolerance_m));
}

/// By how much the gaps of a pair along its plane are enough.
Real Proxy::worth_m(const ReachedPair& reached, Real least_m) const noexcept {
  const Real worth = reached.gap_q_m - least_from(least_m, reached.gap_p_m);
  if (worth < 0) return worth;
  return std::min(
      worth, reached.path_m - deepest_on_way(parameters_.scale, reached.gap_p_m, has_facets()));
}

/// True if the plane that a pair has certifies it.
bool Proxy::keeps_plane(ReachedPair& reached, const Step& step, Real least_m,
                        ProxyTick& tick) const noexcept {
  reached.exact_q = true;
  reached.shared = false;
  reached.shared_m = -std::numeric_limits<Real>::max();
  const ValidPlane own{reached.plane, reached.support, reached.gap_p_m};
  take_plane(reached, worth_of(reached, own, step, least_m, tick));
  return worth_m(reached, least_m) >= 0;
}

/// True if to find the set of planes of a pair takes long.
bool Proxy::has_many_nodes(const ReachedPair& reached) const noexcept {
  return near_.pairs[reached.pair].view->record.node_count >= kManyNodes;
}

/// Takes a plane for a pair that the step needs less of, unless it is the `first`, which is taken
/// in any case. Rows of a plane that p is deeper behind than other steps may end would not raise p:
/// it comes last of those that do not certify. `worth`: of the plane that the pair has; @return the
/// same afterwards.
Real Proxy::try_plane(ReachedPair& reached, const ValidPlane& plane, bool first, const Step& step,
                      Real least_m, Real worth, ProxyTick& tick) const noexcept {
  const auto is_deep = [&](Real of, Real gap_p_m) {
    return of < 0 && gap_p_m < -parameters_.scale.tolerance_m / 2;
  };
  const PlaneWorth found = worth_of(reached, plane, step, least_m, tick);
  const bool deep = is_deep(found.worth_m, plane.gap_m);
  const bool was_deep = is_deep(worth, reached.gap_p_m);
  if (!first && (deep != was_deep ? deep : !(found.worth_m > worth))) return worth;
  take_plane(reached, found);
  return found.worth_m;
}

/// True if a face certifies a pair whose valid set takes long to find.
bool Proxy::certify_by_face(ReachedPair& reached, const Step& step, Real least_m, Real& worth,
                            ProxyTick& tick) const noexcept {
  const ProxyPair& pair = near_.pairs[reached.pair];
  const Real least_valid = -valid_depth(parameters_.scale);
  const PairAt p = pair_at(pair, part_.pose), q = pair_at(pair, step.q);
  const ReachedPair before = reached;
  for_each_face(*pair.view, [&](const PlaneId& id) {
    if (face_bound(p, id, reached.support) < least_valid) return true;
    if (face_bound(q, id, reached.support) < least_m) return true;
    tick.work.plane_gaps += 1;
    const PlaneGap at_p = plane_gap(p, id, reached.support);
    if (at_p.gap_m >= least_valid) {
      worth = try_plane(reached, {id, at_p.support, at_p.gap_m}, false, step, least_m, worth, tick);
    }
    return worth < 0;
  });
  if (worth >= 0) return true;
  reached = before;
  return false;
}

/// Finds the plane that certifies a pair best, of one with a facet the first that does, where its
/// own does not; false: there was no budget for it. Exposed planes come first in a valid set, so
/// the best of them is known before the rest is measured.
bool Proxy::certify(ReachedPair& reached, const Step& step, Real least_m,
                    ProxyTick& tick) noexcept {
  const ProxyPair& pair = near_.pairs[reached.pair];
  constexpr Real kLowest = -std::numeric_limits<Real>::max();
  Real worth = worth_m(reached, least_m);
  if (!reached.searched && !may_begin(kSetGrant, tick)) return false;
  const SharedGap shared =
      has_budget(tick) ? shared_gap(reached, step, least_m, tick) : SharedGap{};
  const auto take_shared = [&] {
    reached.shared = true;
    reached.exact_q = false;
    reached.gap_p_m = shared.gap_p_m;
    reached.gap_q_m = shared.gap_q_m;
    reached.normal_q_w = shared.normal_q_w;
    reached.path_m = shared.path_m;
  };
  if (shared.worth_m >= 0) {
    take_shared();
    return true;
  }
  if (!reached.searched && has_many_nodes(reached) &&
      certify_by_face(reached, step, least_m, worth, tick)) {
    return true;
  }
  if (!reached.searched) find_valid(reached, tick);
  ReachedPair exposed;
  Real exposed_worth = kLowest;
  for (std::uint32_t k = 0; k < reached.valid_count; ++k) {
    const ValidPlane& plane = found_.valid[reached.valid_begin + k];
    worth = try_plane(reached, plane, k == 0, step, least_m, worth, tick);
    // A facet that slides past is not kept for long by the best of its planes either.
    if (worth >= 0 && pair.view->has_facet()) return true;
    if (k + 1 != reached.exposed_count) continue;
    exposed = reached;
    exposed_worth = worth;
  }
  if (worth >= 0) return true;
  // Any plane certifies; one that only separates is imposed where nothing else is there to be.
  if (exposed_worth > kLowest) {
    reached.plane = exposed.plane;
    reached.support = exposed.support;
    reached.gap_p_m = exposed.gap_p_m;
    reached.gap_q_m = exposed.gap_q_m;
    reached.normal_q_w = exposed.normal_q_w;
    reached.path_m = exposed.path_m;
  }
  // A direction that is good for the end asks for a shorter step, not for a plane.
  const bool lacks = reached.gap_q_m < least_from(least_m, reached.gap_p_m);
  if (lacks && shared.worth_m > kLowest) take_shared();
  return true;
}

/// The gap of a reached pair on a step of these lengths, along the direction that it has at p. No
/// vertex of A moves farther than |dx| + r |dtheta|. Where that is too much and a direction is
/// known, a vertex v of A moves along it by n.dx + v.(n x dtheta), but for |v| theta^2 2/3 at the
/// most; both are linear in the share of the step but for the last. (Among facets it is asked at
/// once: they slide on each other, and what it says of the end lasts.)
Proxy::HeldGap Proxy::held_gap(const ReachedPair& reached, const Step& step, Real far_m,
                               Real turn_rad) const noexcept {
  const ProxyPair& pair = near_.pairs[reached.pair];
  const Real swept_m = far_m + turn_rad * pair.reach_a_m;
  const HeldGap any{reached.gap_m - swept_m, reached.gap_m - swept_m};
  const bool is_enough = !has_facets() && any.on_way_m > parameters_.scale.tolerance_m;
  if (!pair.has_held || is_enough) return any;
  const Vec3 across = pair.held_w.cross(step.dtheta_rad);
  const Real fall_m = -pair.held_w.dot(step.dx_m) - (part_.pose.r_wa * pair.middle_a).dot(across) +
                      pair.radius_a_m * std::sqrt(across.squaredNorm());
  const Real bend_m =
      kTurnBend * pair.reach_a_m * turn_rad * turn_rad + kHeldRounding * kRealEpsilon * swept_m;
  return {std::max(any.at_end_m, reached.gap_m - (fall_m + bend_m)),
          std::max(any.on_way_m, reached.gap_m - (std::max(fall_m, Real{0}) + bend_m))};
}

/// One check of a step, on the stack: the step, what it has found so far, and the pairs that their
/// own plane does not certify.
class Proxy::StepCheck {
 public:
  StepCheck(Proxy& proxy, const Step& step, Real least_m, ProxyTick& tick,
            const Step* before) noexcept;
  [[nodiscard]] Check run() noexcept;

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  void keep_to_lists() noexcept;
  void look_at(std::uint32_t begin) noexcept;
  [[nodiscard]] bool is_still_sound(ReachedPair& reached, const ProxyPair& pair) const noexcept;
  [[nodiscard]] bool is_held(ReachedPair& reached, const ProxyPair& pair) noexcept;
  [[nodiscard]] bool is_certified(ReachedPair& reached, ProxyPair& pair) noexcept;
  [[nodiscard]] bool seat_lacking(std::uint32_t& slot, const ReachedPair& passing) noexcept;
  void note_lacking(std::uint32_t k) noexcept;
  void look_at_lacking() noexcept;
  void pick_next() noexcept;
  void screen() noexcept;

  Proxy& proxy_;
  const Step& step_;
  ProxyTick& tick_;
  BoundedList<ReachedPair>& reached_;
  const Real least_m_;  ///< gap that a pair may have at the end of the step, >= this
  const Real tolerance_m_;
  const bool knows_;                  ///< the step before tells how much a sound pair can have lost
  Real apart_m_ = 0, apart_rad_ = 0;  ///< of the step before
  const Real far_m_, turn_rad_;       ///< of the step
  Check result_;
  bool unsure_ = false;  ///< the budget has ended before all were known
  /// The pairs that lack, in the order in which they were found: a list through next_open.
  std::uint32_t first_open_ = kNone, last_open_ = kNone;
  std::uint32_t first_ = kNone;  ///< the one of them that lacks most by its own plane
};

Proxy::StepCheck::StepCheck(Proxy& proxy, const Step& step, Real least_m, ProxyTick& tick,
                            const Step* before) noexcept
    : proxy_(proxy),
      step_(step),
      tick_(tick),
      reached_(proxy.pass_.reached),
      least_m_(least_m),
      tolerance_m_(proxy.parameters_.scale.tolerance_m),
      knows_(kSceneTraits.facets && before != nullptr && proxy.has_long_lists()),
      far_m_(std::sqrt(step.dx_m.squaredNorm())),
      turn_rad_(std::sqrt(step.dtheta_rad.squaredNorm())) {
  if (!knows_) return;
  constexpr Real kUp = 1 + 16 * kRealEpsilon;
  apart_m_ = std::sqrt((step.q.x0_w - before->q.x0_w).squaredNorm()) * kUp;
  apart_rad_ = std::sqrt((step.dtheta_rad - before->dtheta_rad).squaredNorm()) * kUp;
}

/// Where there was no room for every pair near p, no way leads to one that is not in the list.
void Proxy::StepCheck::keep_to_lists() noexcept {
  const Real clear_m = proxy_.unlisted_m();
  const Real listed_m = proxy_.list_motion_m(far_m_, turn_rad_);
  const NearPairs& list = proxy_.near_.list;
  if (listed_m > clear_m) {
    result_.ok = false;
    result_.share = std::max(clear_m / listed_m, kLeastShare);
    if (!(clear_m > kLeastShare * listed_m)) tick_.limited = true;
    tick_.crowded = tick_.crowded || list.overflowed();
  }
  for (const LeftOut& left : list.left_out()) {
    const Real taken = taken_m(left, step_.dx_m, step_.dtheta_rad);
    const Real room_m = std::max(left.gap_m - proxy_.skin_m() + tolerance_m_ / 2, Real{0});
    if (!(taken > room_m)) continue;
    result_.ok = false;
    result_.share = std::min(result_.share, std::max(room_m / taken, kLeastShare));
    if (!(room_m > kLeastShare * taken)) tick_.limited = true;
    tick_.crowded = true;
  }
}

void Proxy::StepCheck::note_lacking(std::uint32_t k) noexcept {
  reached_[k].open = true;
  reached_[k].next_open = kNone;
  (first_open_ == kNone ? first_open_ : reached_[last_open_].next_open) = k;
  last_open_ = k;
  if (first_ == kNone || reached_[k].gap_q_m < reached_[first_].gap_q_m) first_ = k;
}

/// Of all that lack still the one that lacks most.
void Proxy::StepCheck::pick_next() noexcept {
  first_ = kNone;
  std::uint32_t scanned = 0;
  for (std::uint32_t at = first_open_; at < kNone; at = reached_[at].next_open, ++scanned) {
    if (!reached_[at].open) continue;
    if (first_ == kNone || reached_[at].gap_q_m < reached_[first_].gap_q_m) first_ = at;
  }
  tick_.work.search_work += scanned / kPickedOfUnit;
}

/// Finds other planes for the pairs that lack: first those that lack most, then in their order.
void Proxy::StepCheck::look_at_lacking() noexcept {
  std::uint32_t picks = 0, other = first_open_;
  while (first_ < kNone && (picks < kMostPicks || other < kNone)) {
    const bool picked = picks < kMostPicks;
    const std::uint32_t k = picked ? first_ : other;
    if (picked) {
      ++picks;
    } else {
      other = reached_[k].next_open;
    }
    ReachedPair& reached = reached_[k];
    const Real lacks_m = proxy_.least_from(least_m_, reached.gap_p_m) - reached.gap_q_m;
    const bool is_known = reached.searched || !proxy_.has_many_nodes(reached);
    const bool waits = result_.lacking_m > 0 && !(lacks_m > result_.lacking_m && is_known);
    if (!reached.open || waits) continue;
    if (!proxy_.certify(reached, step_, least_m_, tick_)) {
      unsure_ = true;
      break;
    }
    reached.open = false;
    proxy_.judge_gap(k, least_m_, result_);
    if (picked) pick_next();
  }
  first_ = kNone;
}

/// True if the check before found a pair so far apart that it still is.
bool Proxy::StepCheck::is_still_sound(ReachedPair& reached, const ProxyPair& pair) const noexcept {
  const bool was_sound = knows_ && reached.sound && reached.checked + 1 == proxy_.pass_.checks;
  reached.checked = proxy_.pass_.checks;
  if (!was_sound) return false;
  const Real less_m = apart_m_ + apart_rad_ * pair.reach_a_m;
  const Real least = std::min(reached.gap_q_m, reached.path_m) - less_m;
  if (!(least > tolerance_m_)) return false;
  reached.shared = reached.shared || reached.exact_q;
  reached.exact_q = false;
  reached.gap_q_m -= less_m;
  reached.path_m -= less_m;
  return true;
}

/// True if the direction that is held for a pair certifies it.
bool Proxy::StepCheck::is_held(ReachedPair& reached, const ProxyPair& pair) noexcept {
  HeldGap held = proxy_.held_gap(reached, step_, far_m_, turn_rad_);
  if (!reached.exact_p && !(held.on_way_m > tolerance_m_)) {
    proxy_.look_closer(reached, tick_);
    held = proxy_.held_gap(reached, step_, far_m_, turn_rad_);
  }
  if (!(held.on_way_m > tolerance_m_)) return false;
  reached.plane = pair.plane;
  reached.support = pair.support;
  reached.gap_p_m = reached.gap_m;
  reached.gap_q_m = held.at_end_m;
  reached.path_m = held.on_way_m;
  reached.exact_q = reached.shared = false;
  return true;
}

/// True if a pair needs no other plane than its own, or cannot be told for want of budget.
bool Proxy::StepCheck::is_certified(ReachedPair& reached, ProxyPair& pair) noexcept {
  if (is_still_sound(reached, pair)) return true;
  reached.sound = is_held(reached, pair);
  if (reached.sound) return true;
  if (reached.unsure) {
    unsure_ = true;
    reached.exact_q = false;
    return true;
  }
  proxy_.need_view(pair, tick_);
  reached.sound = proxy_.keeps_plane(reached, step_, least_m_, tick_);
  return reached.sound;
}

/// Gives a seat to a pair that lacks and has none; false: there is no room for it.
bool Proxy::StepCheck::seat_lacking(std::uint32_t& slot, const ReachedPair& passing) noexcept {
  std::uint32_t seat = proxy_.free_seat(least_m_, false);
  if (seat == reached_.size()) {
    tick_.work.search_work += 1 + reached_.size() / kSeatsOfUnit;
    look_at_lacking();
    seat = proxy_.free_seat(least_m_, true);
  }
  if (seat == reached_.size() || unsure_) return false;
  proxy_.give_seat(seat, slot, passing);
  note_lacking(seat);
  return true;
}

/// The pairs from `begin` on, those with a seat first.
void Proxy::StepCheck::look_at(std::uint32_t begin) noexcept {
  const std::span<std::uint32_t> others = proxy_.beside();
  ReachedPair passing;
  const std::uint32_t seated = reached_.size();
  for (std::uint32_t k = begin; k < seated + others.size(); ++k) {
    if (k >= seated) passing = proxy_.seen(others[k - seated]);
    ReachedPair& reached = k < seated ? reached_[k] : passing;
    reached.open = false;
    if (is_certified(reached, proxy_.near_.pairs[reached.pair])) continue;
    if (k < seated) {
      note_lacking(k);
    } else if (!seat_lacking(others[k - seated], passing)) {
      result_.ok = false;  // what lacks already is enough for one round
      break;
    }
  }
  look_at_lacking();
}

/// Those that the screen cannot certify join the others, until it has no more.
void Proxy::StepCheck::screen() noexcept {
  for (bool goes_on = false; result_.ok && !unsure_; goes_on = true) {
    const std::uint32_t begin = reached_.size();
    const Screened end = proxy_.screen_step(step_, least_m_, goes_on, tick_);
    if (end == Screened::kDone) break;
    if (end == Screened::kMissed) {
      look_at(begin);
    } else if (end == Screened::kRefused) {
      result_.ok = false;
      result_.share = std::min(result_.share, kRefusedShare);
    } else {
      unsure_ = true;
    }
  }
  if (!result_.ok) proxy_.near_.screen->forget_done();
}

Proxy::Check Proxy::StepCheck::run() noexcept {
  proxy_.pass_.checks += 1;
  const Real motion = far_m_ + turn_rad_ * proxy_.parameters_.radius_m;
  if (motion > proxy_.pass_.reach_m) proxy_.widen(motion, tick_);
  keep_to_lists();
  look_at(0);
  if (proxy_.has_screen()) screen();
  // Another pair that lacks a plane is told first: its plane may keep this one clear too.
  if (unsure_) {
    result_.ok = false;
    proxy_.move_.spent = !(result_.lacking_m > 0);
  }
  return result_;
}

/// Looks at the planes of the pairs whose own do not certify them only as far as it may change the
/// outcome: no plane lacks more than a pair's own, so a pair that lacks no more by that than
/// another does by its best is not the worst. Where one lacks by its best, no large set of planes
/// is found for another: in a tight fit hundreds may lack nearly as much, and the step changes
/// before their sets are of use.
/// Among facets what is certified at the step `before`, of the check before, with more room than
/// the ends of the two are apart, is not looked at again.
Proxy::Check Proxy::check(const Step& step, Real least_m, ProxyTick& tick,
                          const Step* before) noexcept {
  return StepCheck(*this, step, least_m, tick, before).run();
}

/// What the planes of a pair at a step, all of them looked at, say of it.
void Proxy::judge_gap(std::uint32_t k, Real least_m, Check& result) const noexcept {
  const ReachedPair& reached = pass_.reached[k];
  const Real lacking = least_from(least_m, reached.gap_p_m) - reached.gap_q_m;
  const Real deepest_m = deepest_on_way(parameters_.scale, reached.gap_p_m, has_facets());
  if (lacking > 0) {
    result.ok = false;
    if (lacking > result.lacking_m || (lacking == result.lacking_m && k < result.worst)) {
      result.lacking_m = lacking;
      result.worst = k;
    }
  } else if (reached.path_m < deepest_m) {
    // How deep the way dips grows with the square of the step.
    const Real ends = std::min(reached.gap_p_m, reached.gap_q_m);
    const Real room = std::max(ends - deepest_m, 0.25_r * parameters_.scale.tolerance_m);
    const Real share = 0.9_r * std::sqrt(std::min<Real>(room / (ends - reached.path_m), 1));
    result.share = std::min(result.share, std::max(share, kLeastShare));
    result.ok = false;
  }
}

/// Displaces a step that is not certified out of what it violates, without turning it. A pair whose
/// planes were not looked at has no row yet: what lacks more than it comes first.
bool Proxy::correct(Step& step, ProxyTick& tick) noexcept {
  const ProxyScale& scale = parameters_.scale;
  Step trial = step;
  for (std::uint32_t k = 0; k <= kMaxCorrections; ++k) {
    if (!may_begin(kRoundGrant, tick)) return false;
    const Check result = check(trial, kCorrectedShare * -scale.tolerance_m, tick);
    if (result.ok) {
      const Real most = scale.step_m + scale.margin_m;
      if ((trial.dx_m - step.dx_m).squaredNorm() > most * most) return false;
      step = trial;
      return true;
    }
    if (k == kMaxCorrections || !(result.lacking_m > 0)) break;
    program_.rows.clear();
    for (const ReachedPair& reached : pass_.reached) {
      if (!reached.exact_q || reached.open || reached.gap_q_m > scale.step_m) continue;
      const ProxyPair& pair = near_.pairs[reached.pair];
      const PlaneGap gap = plane_gap(pair_at(pair, trial.q), reached.plane, reached.support);
      tick.work.plane_gaps += 1;
      if (!gap.defined) continue;
      QpRow row;
      row.g.head<3>() = gap.normal_w;
      row.h = -gap.gap_m;
      if (!program_.rows.push(row)) return false;
    }
    const QpResult found = solve_rows(1.0e-4_r * scale.tolerance_m, tick);
    trial = step_by(trial.dx_m + found.z.head<3>(), trial.dtheta_rad);
  }
  return false;
}

}  // namespace haptic
