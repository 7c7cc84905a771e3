// SPDX-License-Identifier: Apache-2.0
// Which pairs a pass of the proxy can bring into contact: the list of near pairs, their gaps at p,
// and the planes that certify them.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "rt_core/contact/piece_sphere.hpp"
#include "rt_core/proxy/edge_lines.hpp"
#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {
namespace {

/// A list of near pairs that takes several ticks is begun while what is left of the one before
/// lasts for this multiple of them, and is made shorter where it takes more than so many.
constexpr Real kEarlyTicks = 1.25_r;
constexpr std::uint32_t kLongLists = 24;
/// A motion whose way is shorter than this share of that of the radius counts as a turn; then the
/// range of a list is for pieces near the axis no less than this share of that at the radius.
constexpr Real kTurningShare = 0.1_r, kLeastListShare = 0.4_r;
/// Near pairs beyond so many reaches are left aside together.
constexpr Real kHotReaches = 1.5_r;
/// Among facets a pass first looks no farther than so many of the last steps.
constexpr Real kReachSteps = 1.5_r, kFacetMargin = 0.125_r;

/// Roundings of how far a piece is along a direction, in those of the whole way.
constexpr Real kMiddleRounding = 32;
/// A gap that the part's motion may have taken less of than this is not computed again.
constexpr Real kStaleShare = 0.5_r, kFacetStaleShare = 0.1_r;

/// Gap between the spheres round the two pieces, a lower bound of their distance [m].
Real sphere_gap(const PairAt& at) noexcept {
  const PieceRecord& a = *at.view.a.record;
  const PieceRecord& b = *at.view.b.record;
  const Vec3 between = (at.y_w - piece_centre(b)) + at.r_wa * piece_centre(a);
  return std::sqrt(between.squaredNorm()) -
         static_cast<Real>(a.radius_m + b.radius_m) * (1 + kRealEpsilon) - gap_rounding(at) -
         at.view.skin_m;
}

}  // namespace

/// The pair's pose at p; turns the vertices of its piece of A if no pair before it has.
PairPose Proxy::pose_of(const ProxyPair& pair) noexcept {
  const std::uint32_t piece = pair.view->record.piece_a;
  Real* const lanes = part_.lanes.data() + part_.lanes_begin[piece];
  if (part_.lanes_version[piece] != part_.version) {
    turn_vertices(pair.view->a, part_.pose.r_wa, lanes);
    part_.lanes_version[piece] = part_.version;
  }
  const PairAt at = pair_at(pair, part_.pose);
  return make_pair_pose(at.view, lanes, at.r_wa, at.y_w);
}

/// Nearest C-face of a pair at p, by an exact search without history.
void Proxy::search_fully(ProxyPair& pair, ProxyTick& tick) noexcept {
  const PairPose pose = pose_of(pair);
  Arena arena(reinterpret_cast<std::byte*>(scratch_.search_memory.data()));
  FeatureBounds bounds;
  bounds.place(arena, *pair.view->a.record, *pair.view->b.record);
  bounds.reset(pair.view->marks);
  const NearResult found = find_nearest(pose, bounds, *scratch_.near);
  tick.work.full_searches += 1;
  tick.work.search_work +=
      found.feature_evaluations + found.edge_pairs / kEdgePairsOfUnit + found.support_pairs;
  const NearNode& best = found.best;
  pair.plane = PlaneId{};
  pair.plane.type = best.type;
  if (best.type != ContactType::kB) pair.plane.i = best.i;
  if (best.type != ContactType::kA) pair.plane.j = best.j;
  if (best.type == ContactType::kC) {
    const Vec3 v = ConstVec3Map(pair.view->b.edge_directions[best.j].unit);
    pair.plane.flipped = best.normal_w.dot(pose.direction_a(best.i).cross(v)) < 0;
  }
  pair.support = found.support;
  pair.gap_m = std::min(found.d_near_m, best.f_m) - pair.view->skin_m;
  pair.gap_version = part_.version;
  pair.has_held = false;
  pair.known = true;
  pair.inside = pair.gap_m < -valid_depth(parameters_.scale);
  if (kSceneTraits.facets && pair.inside && pair.view->has_facet()) search_between(pair, tick);
}

/// Two facets may be apart though they are along none of their C-faces: where neither has a vertex
/// over the other, along the line between the nearest points of two of their edges. The longest gap
/// of those is held as the pair's direction.
void Proxy::search_between(ProxyPair& pair, ProxyTick& tick) noexcept {
  const PieceView &a = pair.view->a, &b = pair.view->b;
  const PairAt at = pair_at(pair, part_.pose);
  DirectionGap best;
  best.gap_m = pair.gap_m;
  std::uint32_t asked = 0;
  for (std::uint32_t i = 0; i < a.edge_count; ++i) {
    for (std::uint32_t j = 0; j < b.edge_count && asked < kMostEdgeLines; ++j, ++asked) {
      const Vec3 between_w = line_between_edges_m(at.view, at.r_wa, at.y_w, i, j);
      const Real length = std::sqrt(between_w.squaredNorm());
      if (!(length > parameters_.scale.still_m)) continue;
      tick.work.plane_gaps += 2;
      const DirectionGap gap = direction_gap(at, between_w / length, pair.support);
      if (gap.gap_m > best.gap_m) best = gap;
    }
  }
  if (!(best.gap_m > pair.gap_m)) return;
  hold(pair, best.normal_w, best.gap_m);
  pair.support = best.support;
  pair.gap_m = best.gap_m;
  pair.inside = pair.gap_m < -valid_depth(parameters_.scale);
}

/// Finds the face along which a pair has the largest gap at p; false: it has none along any.
bool Proxy::find_face(ProxyPair& pair, ProxyTick& tick) noexcept {
  const PairAt at = pair_at(pair, part_.pose);
  PlaneGap best;
  for_each_face(*pair.view, [&](const PlaneId& id) {
    const Real least = best.defined ? std::max(best.gap_m, Real{0}) : Real{0};
    if (face_bound(at, id, pair.support) < least) return true;
    tick.work.plane_gaps += 1;
    const PlaneGap gap = plane_gap(at, id, pair.support);
    if (!best.defined || gap.gap_m > best.gap_m) best = gap;
    return true;
  });
  if (!best.defined || best.gap_m < 0) return false;
  hold(pair, best.normal_w, best.gap_m);
  pair.plane = best.id;
  pair.support = best.support;
  pair.gap_m = best.gap_m;
  pair.gap_version = part_.version;
  pair.known = true;
  pair.inside = false;
  return true;
}

/// What the gap of a pair at p is at least, from when it was last looked at.
Real Proxy::clear_m(const ProxyPair& pair) const noexcept {
  return static_cast<Real>(pair.clear_until_m - odometer_m(pair) * (1 + kOdometerRounding));
}

/// The direction along which the gap of a pair at p has been measured.
void Proxy::hold(ProxyPair& pair, const Vec3& normal_w, Real gap_m) const noexcept {
  pair.held_w = normal_w;
  pair.held_m = gap_m - normal_w.dot(part_.pose.x0_w + part_.pose.r_wa * pair.middle_a);
  pair.held_turn_rad = part_.turn_rad;
  pair.has_held = true;
}

/// What the gap of a pair at p is along that direction at least: the middle of the piece of A
/// tells it but for the turn about that, since when it was measured.
Real Proxy::along_held_m(const ProxyPair& pair) const noexcept {
  const Vec3 middle_w = part_.pose.x0_w + part_.pose.r_wa * pair.middle_a;
  const Real turn_rad = static_cast<Real>(part_.turn_rad - pair.held_turn_rad);
  const Real round_m =
      kMiddleRounding * kRealEpsilon *
      (std::abs(pair.held_m) + std::sqrt(part_.pose.x0_w.squaredNorm()) + pair.reach_a_m);
  return pair.held_m + pair.held_w.dot(middle_w) - (turn_rad * pair.radius_a_m + round_m);
}

/// True if a tick may begin the search of a pair: of the first it always may, and pairs that have
/// waited come before others.
bool Proxy::may_search(ProxyPair& pair, ProxyTick& tick) noexcept {
  const bool first = (move_.grants & kSearchGrant) == 0 && (!near_.waited || pair.waits);
  if (first) move_.grants |= kSearchGrant;
  pair.waits = !first && !has_budget(tick);
  near_.waiting = near_.waiting || pair.waits;
  return !pair.waits;
}

/// Computes the gap of a pair at p along its plane; where it has none left, or no plane yet, finds
/// one. False: for want of budget it has none still.
bool Proxy::measure(ProxyPair& pair, ProxyTick& tick) noexcept {
  need_view(pair, tick);
  const PairAt at = pair_at(pair, part_.pose);
  if (pair.known) {
    const PlaneGap gap = plane_gap(at, pair.plane, pair.support);
    tick.work.plane_gaps += 1;
    pair.support = gap.support;
    pair.gap_m = gap.defined ? gap.gap_m : -std::numeric_limits<Real>::max();
    pair.gap_version = part_.version;
    hold(pair, gap.normal_w, pair.gap_m);
  }
  const bool lost = !pair.known || pair.gap_m < -valid_depth(parameters_.scale);
  // What is known of the pair's distance says nothing of its gap along a plane that is lost.
  if (lost) pair.has_held = false;
  if (lost && !may_search(pair, tick)) {
    pair.gap_version = 0;  // that of a plane which certifies nothing is none
    return false;
  }
  if (lost && !find_face(pair, tick)) search_fully(pair, tick);
  pair.clear_until_m = odometer_m(pair) + static_cast<double>(pair.gap_m - gap_rounding(at));
  return true;
}

/// True if a pass can bring the pair into contact; then `reached` tells where it stands: by a lower
/// bound of its gap while that is at least half of what it was, when it was last computed.
bool Proxy::reach_pair(ProxyPair& pair, ReachedPair& reached, ProxyTick& tick) noexcept {
  Real gap = pair.gap_m;
  if (pair.inside) {
    need_view(pair, tick);
    // The part is led out; where the pair cannot be searched again, its plane tells how deep it is.
    if (may_search(pair, tick)) {
      search_fully(pair, tick);
    } else {
      const PlaneGap held = plane_gap(pair_at(pair, part_.pose), pair.plane, pair.support);
      tick.work.plane_gaps += 1;
      if (held.defined) pair.gap_m = held.gap_m;
      pair.gap_version = part_.version;
    }
    gap = pair.gap_m;
  } else if (pair.gap_version != part_.version) {
    Real clear = clear_m(pair);
    const Real stale = has_facets() ? kFacetStaleShare : kStaleShare;
    if (has_long_lists() && pair.has_held && clear < pass_.reach_m) {
      const Real held_m = along_held_m(pair);
      if (held_m > clear) {
        clear = held_m;
        pair.clear_until_m = odometer_m(pair) + static_cast<double>(held_m);
      }
      if (pair.known && clear >= pass_.reach_m) return false;
    }
    reached.exact_p = !(pair.known && clear > 0 && clear >= stale * pair.gap_m);
    gap = clear;
    if (reached.exact_p && !pair.known) {
      need_view(pair, tick);
      gap = sphere_gap(pair_at(pair, part_.pose));
      if (pair.view->has_facet()) gap = std::max(gap, clear);  // boxes know more of a facet
      pair.clear_until_m = odometer_m(pair) + static_cast<double>(gap);
      if (gap >= pass_.reach_m) return false;
    }
    if (reached.exact_p) {
      reached.unsure = !measure(pair, tick);
      if (!reached.unsure) gap = pair.gap_m;
      if (!reached.unsure && clear_m(pair) >= pass_.reach_m) return false;
    }
  }
  reached.gap_m = reached.gap_p_m = reached.gap_q_m = reached.path_m = gap;
  reached.plane = pair.plane;
  reached.support = pair.support;
  return true;
}

/// The gap itself where a bound of it does not do.
void Proxy::look_closer(ReachedPair& reached, ProxyTick& tick) noexcept {
  ProxyPair& pair = near_.pairs[reached.pair];
  reached.unsure = !measure(pair, tick);
  if (reached.unsure) return;
  reached.gap_m = reached.gap_p_m = reached.gap_q_m = reached.path_m = pair.gap_m;
  reached.plane = pair.plane;
  reached.support = pair.support;
  reached.exact_p = true;
}

/// The pairs that a pass can bring into contact.
void Proxy::gather(const PoseError& error, ProxyTick& tick) noexcept {
  pass_.reached.clear();
  pass_.beside.clear();
  if (found_.sets_version != part_.version) {
    found_.sets_version = part_.version;
    found_.valid.clear();
    found_.sets.clear();
  }
  pass_.number += 1;
  const ProxyScale& scale = parameters_.scale;
  const Real pull_m = std::sqrt(error.translation_m.squaredNorm()) +
                      parameters_.radius_m * std::sqrt(error.rotation_rad.squaredNorm());
  pass_.reach_m =
      std::min({scale.reach_m, pull_m + scale.margin_m,
                range_.trust_m < scale.reach_m ? range_.trust_m + scale.margin_m : scale.reach_m});
  pass_.inside = pass_.recovering = false;
  pass_.worst_gap_m = std::numeric_limits<Real>::max();
  // Among facets that conform, a pull is not the way that a step will go; a longer one widens this.
  if (has_facets()) {
    pass_.reach_m = std::min(pass_.reach_m, kReachSteps * near_.pass_steps_m[step_place()] +
                                                kFacetMargin * scale.margin_m);
  }
  reach_all(tick);
}

/// Takes those pairs in too that a step of this length can meet.
void Proxy::widen(Real motion_m, ProxyTick& tick) noexcept {
  pass_.reach_m = (has_facets() ? kReachSteps : 4) * motion_m;
  reach_all(tick);
}

/// A pair has left its slot: nothing may name it any more.
void Proxy::forget(std::uint32_t slot) noexcept {
  const auto drop = [&](auto& list, const auto& is_of) {
    std::uint32_t kept = 0;
    for (const auto& item : list) {
      if (!is_of(item)) list[kept++] = item;
    }
    list.truncate(kept);
  };
  drop(kept_.active, [&](const ImposedPlane& plane) { return plane.pair == slot; });
  drop(kept_.pending, [&](const ImposedPlane& plane) { return plane.pair == slot; });
  drop(program_.cones, [&](const FrictionCone& cone) { return cone.pair == slot; });
  drop(slip_.last_cones, [&](const FrictionCone& cone) { return cone.pair == slot; });
  for (PlaneRegion& region : part_.regions) {
    if (region.pair == slot) region.version = 0;
  }
}

/// A pair has come to a slot.
void Proxy::enter(std::uint32_t slot) noexcept {
  const NearPair& near = near_.list[slot];
  const SceneView& scene = near_.scene[0];
  const PairRecord record = scene.pair_record(near.pair);
  const PieceRecord& a = scene.pieces()[record.piece_a];
  const BodyRecord& body = scene.bodies()[scene.pieces()[record.piece_b].body];
  ProxyPair& pair = near_.pairs[slot];
  pair = ProxyPair{};
  pair.index = near.pair;
  for (int k = 0; k < 3; ++k) pair.reference_w[k] = static_cast<Real>(body.reference_m[k]);
  pair.reach_a_m = static_cast<Real>(a.reach_m);
  pair.middle_a = piece_centre(a);
  pair.radius_a_m = static_cast<Real>(a.radius_m) * (1 + kRealEpsilon);
  pair.friction = static_cast<Real>(body.friction);
  pair.friction_static = static_cast<Real>(body.friction_static);
  pair.clear_until_m = range_.list_path_m +
                       range_.list_turn_rad * static_cast<double>(pair.reach_a_m) +
                       static_cast<double>(near.gap_m - skin_m());
}

/// Goes on with the list of near pairs, or begins one, of those within reach and as far again so
/// that it lasts for a while. Where one list is more than a tick has time for, the next is begun
/// early.
void Proxy::list_pairs(ProxyTick& tick) noexcept {
  if (has_screen()) return renew_screen(tick);
  const ProxyScale& scale = parameters_.scale;
  // For a motion like the last one.
  const Real came_m = std::sqrt(slip_.came.translation_m.squaredNorm());
  const Real came_rad = std::sqrt(slip_.came.rotation_rad.squaredNorm());
  const Real turned_m = parameters_.radius_m * came_rad;
  const Real listed_m = list_motion_m(came_m, came_rad);
  const Real of_list =
      has_long_lists() && listed_m > 0 ? (came_m + turned_m) / listed_m : near_.list.least_share();
  const Real clear_m = of_list * unlisted_m();
  // Pairs without a slot that have cut a step may have one in a list made where the part is now.
  const bool cut = tick.crowded && has_left_out() &&
                   (part_.path_m != range_.list_path_m || part_.turn_rad != range_.list_turn_rad);
  const bool short_of = cut || !(clear_m >= pass_.reach_m);
  const Real until_made_m =
      kEarlyTicks * static_cast<Real>(range_.list_ticks) * near_.tick_motion_m;
  const bool early = range_.list_ticks > 1 && !(clear_m >= pass_.reach_m + until_made_m);
  if (!short_of && !early && !near_.list.is_begun()) return;
  if (!near_.list.is_begun()) {
    const Real further_m = has_facets() ? scale.reach_m / 2 : scale.reach_m;
    range_.list_m = std::min(range_.list_m, pass_.reach_m + further_m);
    if (has_facets()) range_.list_m = std::max(range_.list_m, 2 * pass_.reach_m);
    // Of solids without a slot the fewer are near, the sooner the next list is made.
    if (near_.list.overflowed() && !has_facets()) range_.list_m = pass_.reach_m;
    // A part that mostly turns takes less from the gaps of what is near its axis.
    const bool turns = has_long_lists() && came_m <= kTurningShare * turned_m;
    const Real share = turns ? kLeastListShare : Real{1};
    near_.list.begin(part_.pose, list_odometer_m(share), range_.list_m, share,
                     parameters_.radius_m);
    range_.list_age = 1;
    range_.list_path_m = part_.path_m;
    range_.list_turn_rad = part_.turn_rad;
    // A scene whose lists are never long may make another one.
    if (range_.visits_of_tick < kListVisitsOfTick && has_budget(tick)) {
      move_.list_visits_left = range_.visits_of_tick;
    }
  }
  if (move_.list_visits_left == 0) return;
  for (const ReachedPair& reached : pass_.reached) near_.list.pin(reached.pair);
  for (const std::uint32_t slot : beside()) near_.list.pin(slot);
  const auto go_on = [&](std::uint32_t most_visits) {
    const std::uint32_t before = near_.list.visited();
    const bool finished =
        near_.list.go_on(most_visits, list_odometer_m(near_.list.begun_share()), pass_.reach_m);
    const std::uint32_t visits = near_.list.visited() - before;
    move_.list_visits_left -= std::min(visits, move_.list_visits_left);
    tick.work.list_visits += visits;
    return finished;
  };
  bool finished = go_on(move_.list_visits_left);
  // Where the part has outrun its list it can but wait: the rest of the tick is for the next one.
  if (!finished && !(unlisted_m() > 2 * scale.still_m) && has_budget(tick)) {
    finished = go_on(kListVisitsOfUnit * (parameters_.work_units - tick.work.units()));
  }
  if (!finished) return;
  range_.list_ticks =
      has_long_lists() ? range_.list_age : near_.list.visited() / kListVisitsOfTick + 1;
  range_.list_m *= near_.list.visited() > kLongLists * kListVisitsOfTick ? kTrustLess : kTrustMore;
  for (const std::uint32_t slot : near_.list.changed()) {
    forget(slot);
    if (near_.list.holds(slot)) enter(slot);
  }
  near_.hot_until_m = -std::numeric_limits<double>::max();
}

/// The pairs that a pass looks at one by one: all, or of many those that are near, so that the
/// others cost one comparison together.
std::span<const std::uint32_t> Proxy::hot_pairs() noexcept {
  if (near_.hot.capacity() == 0) return near_.list.slots();
  if (cold_m() >= pass_.reach_m) return near_.hot.view();
  near_.hot.clear();
  Real cold_m = std::numeric_limits<Real>::max();
  for (const std::uint32_t slot : near_.list.slots()) {
    const ProxyPair& pair = near_.pairs[slot];
    const Real clear = pair.gap_version == part_.version ? pair.gap_m : clear_m(pair);
    if (pair.inside || !(clear >= kHotReaches * pass_.reach_m)) {
      static_cast<void>(near_.hot.push(slot));
    } else {
      cold_m = std::min(cold_m, clear);
    }
  }
  near_.hot_until_m = odometer_m() + static_cast<double>(cold_m);
  return near_.hot.view();
}

Real Proxy::left_out_m() const noexcept {
  Real gap_m = std::numeric_limits<Real>::max();
  for (const LeftOut& left : near_.list.left_out()) gap_m = std::min(gap_m, left.gap_m - skin_m());
  return gap_m;
}

/// Takes a pair that may be within the pass's reach into its lists, once a pass; what its gap is at
/// least, where it was `known_m` before.
Real Proxy::take_in(std::uint32_t slot, Real known_m, ProxyTick& tick) noexcept {
  ProxyPair& pair = near_.pairs[slot];
  if (pair.reached_in == pass_.number) return known_m;
  ReachedPair reached;
  if (!reach_pair(pair, reached, tick)) {
    const Real found_m = clear_m(pair);
    tick.gap_m = std::min(tick.gap_m, found_m);
    return found_m;
  }
  reached.pair = slot;
  recall_valid(reached);
  pair.reached_in = pass_.number;
  pass_.worst_gap_m = std::min(pass_.worst_gap_m, reached.gap_m);
  if (pass_.reached.push(reached)) {
    need_view(pair, tick);
    keep_view(slot, true);
  } else {
    stand_beside(reached, tick);
  }
  if (pair.inside) {
    // Rounding and what is lower than a step that holds the part are left without a word.
    const Real slight_m = valid_depth(parameters_.scale) + parameters_.scale.climb_m;
    pass_.inside = true;
    pass_.recovering = pass_.recovering || out_.led_out || -reached.gap_m > slight_m;
  }
  return reached.gap_m;
}

/// Appends the pairs within the pass's reach that are not in its list yet.
void Proxy::reach_all(ProxyTick& tick) noexcept {
  list_pairs(tick);
  const std::span<const std::uint32_t> slots = hot_pairs();
  pass_.nearest_m = std::min({near_.list.least_share() * unlisted_m(), cold_m(), left_out_m()});
  if (has_screen())
    pass_.nearest_m = std::min(pass_.nearest_m, near_.screen->nearest_m() - skin_m());
  tick.gap_m = std::max(pass_.nearest_m, Real{0});  // p is free of what no list has shown yet
  const auto known_m = [&](const ProxyPair& pair) {
    return pair.gap_version == part_.version ? pair.gap_m : clear_m(pair);
  };
  const auto take_first = [&](const ImposedPlane& plane) {
    const ProxyPair& pair = near_.pairs[plane.pair];
    const Real clear = known_m(pair);
    if (pair.inside || !(clear >= pass_.reach_m)) {
      pass_.nearest_m = std::min(pass_.nearest_m, take_in(plane.pair, clear, tick));
    }
  };
  if (takes_turns()) {  // what holds the part comes before the others
    for (const ImposedPlane& plane : kept_.active) take_first(plane);
    for (const ImposedPlane& plane : kept_.pending) take_first(plane);
  }
  Real far_m = std::numeric_limits<Real>::max();  // of all beyond reach
  for (const std::uint32_t slot : slots) {
    const ProxyPair& pair = near_.pairs[slot];
    const Real clear = known_m(pair);
    if (clear >= pass_.reach_m && !pair.inside) {
      far_m = std::min(far_m, clear);
    } else {
      pass_.nearest_m = std::min(pass_.nearest_m, take_in(slot, clear, tick));
    }
  }
  pass_.nearest_m = std::min(pass_.nearest_m, far_m);
  tick.gap_m = std::min(tick.gap_m, far_m);
}

/// The valid set of a pair, if it has been found at p.
void Proxy::recall_valid(ReachedPair& reached) const noexcept {
  const std::uint32_t number = near_.pairs[reached.pair].set;
  if (number >= found_.sets.size() || found_.sets[number].pair != reached.pair) return;
  const FoundSet& set = found_.sets[number];
  reached.searched = true;
  reached.valid_begin = set.begin;
  reached.valid_count = set.count;
  reached.exposed_count = set.exposed;
}

/// The valid set of a pair at p, once while p stays.
void Proxy::find_valid(ReachedPair& reached, ProxyTick& tick) noexcept {
  ProxyPair& pair = near_.pairs[reached.pair];
  reached.searched = true;
  reached.valid_begin = found_.valid.size();
  if (found_.valid.size() == found_.valid.capacity())
    return;  // its certificate stays its only plane
  const auto only = [&] {
    reached.exposed_count = 0;
    if (found_.valid.push({pair.plane, pair.support, pair.gap_m})) reached.valid_count = 1;
  };
  std::array<ValidPlane, kMaxValidPlanes> planes;
  const Real least = -valid_depth(parameters_.scale);
  const ValidResult found =
      find_valid_planes(pose_of(pair), pair.plane, pair.support, least, scratch_.valid, planes);
  tick.work.valid_nodes += found.visited;
  for (std::uint32_t k = 0; k < found.count; ++k) {
    if (!found_.valid.push(planes[k])) break;
  }
  reached.valid_count = found_.valid.size() - reached.valid_begin;
  reached.exposed_count = std::min(found.exposed, reached.valid_count);
  if (reached.valid_count == 0) {
    search_fully(pair, tick);  // the plane has ceased to be a C-face and none is beside it
    only();
  }
  pair.set = found_.sets.size();
  static_cast<void>(found_.sets.push(
      {reached.pair, reached.valid_begin, reached.valid_count, reached.exposed_count}));
}

}  // namespace haptic
