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
Real sphere_gap(const PairView& pair, const GripPose& p, const Vec3& y_w) noexcept {
  const PieceRecord& a = *pair.a.record;
  const PieceRecord& b = *pair.b.record;
  const Vec3 between = (y_w - piece_centre(b)) + p.r_wa * piece_centre(a);
  return std::sqrt(between.squaredNorm()) -
         static_cast<Real>(a.radius_m + b.radius_m) * (1 + kRealEpsilon) - gap_rounding(pair, y_w) -
         pair.skin_m;
}

}  // namespace

/// The pair's pose at p_; turns the vertices of its piece of A if no pair before it has.
PairPose Proxy::pose_of(const ProxyPair& pair) noexcept {
  const std::uint32_t piece = pair.view->record.piece_a;
  Real* const lanes = lanes_.data() + lanes_begin_[piece];
  if (lanes_version_[piece] != version_) {
    turn_vertices(pair.view->a, p_.r_wa, lanes);
    lanes_version_[piece] = version_;
  }
  return make_pair_pose(*pair.view, lanes, p_.r_wa, p_.x0_w - pair.reference_w);
}

/// Nearest C-face of a pair at p_, by an exact search without history.
void Proxy::search_fully(ProxyPair& pair, ProxyTick& tick) noexcept {
  const PairPose pose = pose_of(pair);
  Arena arena(reinterpret_cast<std::byte*>(search_memory_.data()));
  FeatureBounds bounds;
  bounds.place(arena, *pair.view->a.record, *pair.view->b.record);
  bounds.reset(pair.view->marks);
  const NearResult found = find_nearest(pose, bounds, *near_scratch_);
  tick.full_searches += 1;
  tick.search_work +=
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
  pair.gap_version = version_;
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
  const Vec3 y_w = p_.x0_w - pair.reference_w;
  DirectionGap best;
  best.gap_m = pair.gap_m;
  std::uint32_t asked = 0;
  for (std::uint32_t i = 0; i < a.edge_count; ++i) {
    for (std::uint32_t j = 0; j < b.edge_count && asked < kMostEdgeLines; ++j, ++asked) {
      const Vec3 between_w = line_between_edges_m(*pair.view, p_.r_wa, y_w, i, j);
      const Real length = std::sqrt(between_w.squaredNorm());
      if (!(length > parameters_.scale.still_m)) continue;
      tick.plane_gaps += 2;
      const DirectionGap gap =
          direction_gap(*pair.view, p_.r_wa, y_w, between_w / length, pair.support);
      if (gap.gap_m > best.gap_m) best = gap;
    }
  }
  if (!(best.gap_m > pair.gap_m)) return;
  hold(pair, best.normal_w, best.gap_m);
  pair.support = best.support;
  pair.gap_m = best.gap_m;
  pair.inside = pair.gap_m < -valid_depth(parameters_.scale);
}

/// Finds the face along which a pair has the largest gap at p_; false: it has none along any.
bool Proxy::find_face(ProxyPair& pair, ProxyTick& tick) noexcept {
  const Vec3 y_w = p_.x0_w - pair.reference_w;
  PlaneGap best;
  for_each_face(*pair.view, [&](const PlaneId& id) {
    const Real least = best.defined ? std::max(best.gap_m, Real{0}) : Real{0};
    if (face_bound(*pair.view, p_.r_wa, y_w, id, pair.support) < least) return true;
    tick.plane_gaps += 1;
    const PlaneGap gap = plane_gap(*pair.view, p_.r_wa, y_w, id, pair.support);
    if (!best.defined || gap.gap_m > best.gap_m) best = gap;
    return true;
  });
  if (!best.defined || best.gap_m < 0) return false;
  hold(pair, best.normal_w, best.gap_m);
  pair.plane = best.id;
  pair.support = best.support;
  pair.gap_m = best.gap_m;
  pair.gap_version = version_;
  pair.known = true;
  pair.inside = false;
  return true;
}

/// What the gap of a pair at p_ is at least, from when it was last looked at.
Real Proxy::clear_m(const ProxyPair& pair) const noexcept {
  return static_cast<Real>(pair.clear_until_m - odometer_m(pair) * (1 + kOdometerRounding));
}

/// The direction along which the gap of a pair at p_ has been measured.
void Proxy::hold(ProxyPair& pair, const Vec3& normal_w, Real gap_m) const noexcept {
  pair.held_w = normal_w;
  pair.held_m = gap_m - normal_w.dot(p_.x0_w + p_.r_wa * pair.middle_a);
  pair.held_turn_rad = turn_rad_;
  pair.has_held = true;
}

/// What the gap of a pair at p_ is along that direction at least: the middle of the piece of A
/// tells it but for the turn about that, since when it was measured.
Real Proxy::along_held_m(const ProxyPair& pair) const noexcept {
  const Vec3 middle_w = p_.x0_w + p_.r_wa * pair.middle_a;
  const Real turn_rad = static_cast<Real>(turn_rad_ - pair.held_turn_rad);
  const Real round_m = kMiddleRounding * kRealEpsilon *
                       (std::abs(pair.held_m) + std::sqrt(p_.x0_w.squaredNorm()) + pair.reach_a_m);
  return pair.held_m + pair.held_w.dot(middle_w) - (turn_rad * pair.radius_a_m + round_m);
}

/// Whether a tick may begin the search of a pair: of the first it always may, and pairs that have
/// waited come before others.
bool Proxy::may_search(ProxyPair& pair, ProxyTick& tick) noexcept {
  const bool first = (grants_ & kSearchGrant) == 0 && (!waited_ || pair.waits);
  if (first) grants_ |= kSearchGrant;
  pair.waits = !first && !has_budget(tick);
  waiting_ = waiting_ || pair.waits;
  return !pair.waits;
}

/// Computes the gap of a pair at p_ along its plane; where it has none left, or no plane yet, finds
/// one. False: for want of budget it has none still.
bool Proxy::measure(ProxyPair& pair, ProxyTick& tick) noexcept {
  need_view(pair, tick);
  const Vec3 y_w = p_.x0_w - pair.reference_w;
  if (pair.known) {
    const PlaneGap gap = plane_gap(*pair.view, p_.r_wa, y_w, pair.plane, pair.support);
    tick.plane_gaps += 1;
    pair.support = gap.support;
    pair.gap_m = gap.defined ? gap.gap_m : -std::numeric_limits<Real>::max();
    pair.gap_version = version_;
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
  pair.clear_until_m =
      odometer_m(pair) + static_cast<double>(pair.gap_m - gap_rounding(*pair.view, y_w));
  return true;
}

/// Whether a pass can bring the pair into contact; then `reached` tells where it stands: by a lower
/// bound of its gap while that is at least half of what it was, when it was last computed.
bool Proxy::reach_pair(ProxyPair& pair, ReachedPair& reached, ProxyTick& tick) noexcept {
  Real gap = pair.gap_m;
  if (pair.inside) {
    need_view(pair, tick);
    // The part is led out; where the pair cannot be searched again, its plane tells how deep it is.
    if (may_search(pair, tick)) {
      search_fully(pair, tick);
    } else {
      const PlaneGap held = plane_gap(*pair.view, p_.r_wa, Vec3(p_.x0_w - pair.reference_w),
                                      pair.plane, pair.support);
      tick.plane_gaps += 1;
      if (held.defined) pair.gap_m = held.gap_m;
      pair.gap_version = version_;
    }
    gap = pair.gap_m;
  } else if (pair.gap_version != version_) {
    Real clear = clear_m(pair);
    const Real stale = has_facets() ? kFacetStaleShare : kStaleShare;
    if (has_long_lists() && pair.has_held && clear < reach_m_) {
      const Real held_m = along_held_m(pair);
      if (held_m > clear) {
        clear = held_m;
        pair.clear_until_m = odometer_m(pair) + static_cast<double>(held_m);
      }
      if (pair.known && clear >= reach_m_) return false;
    }
    reached.exact_p = !(pair.known && clear > 0 && clear >= stale * pair.gap_m);
    gap = clear;
    if (reached.exact_p && !pair.known) {
      need_view(pair, tick);
      gap = sphere_gap(*pair.view, p_, p_.x0_w - pair.reference_w);
      if (pair.view->has_facet()) gap = std::max(gap, clear);  // boxes know more of a facet
      pair.clear_until_m = odometer_m(pair) + static_cast<double>(gap);
      if (gap >= reach_m_) return false;
    }
    if (reached.exact_p) {
      reached.unsure = !measure(pair, tick);
      if (!reached.unsure) gap = pair.gap_m;
      if (!reached.unsure && clear_m(pair) >= reach_m_) return false;
    }
  }
  reached.gap_m = reached.gap_p_m = reached.gap_q_m = reached.path_m = gap;
  reached.plane = pair.plane;
  reached.support = pair.support;
  return true;
}

/// The gap itself where a bound of it does not do.
void Proxy::look_closer(ReachedPair& reached, ProxyTick& tick) noexcept {
  ProxyPair& pair = pairs_[reached.pair];
  reached.unsure = !measure(pair, tick);
  if (reached.unsure) return;
  reached.gap_m = reached.gap_p_m = reached.gap_q_m = reached.path_m = pair.gap_m;
  reached.plane = pair.plane;
  reached.support = pair.support;
  reached.exact_p = true;
}

/// The pairs that a pass can bring into contact.
void Proxy::gather(const PoseError& error, ProxyTick& tick) noexcept {
  reached_.clear();
  beside_.clear();
  if (sets_version_ != version_) {
    sets_version_ = version_;
    valid_.clear();
    sets_.clear();
  }
  pass_ += 1;
  const ProxyScale& scale = parameters_.scale;
  const Real pull_m = std::sqrt(error.translation_m.squaredNorm()) +
                      parameters_.radius_m * std::sqrt(error.rotation_rad.squaredNorm());
  reach_m_ = std::min({scale.reach_m, pull_m + scale.margin_m,
                       trust_m_ < scale.reach_m ? trust_m_ + scale.margin_m : scale.reach_m});
  tick.inside = tick.recovering = false;
  worst_gap_m_ = std::numeric_limits<Real>::max();
  // Among facets that conform, a pull is not the way that a step will go; a longer one widens this.
  if (has_facets()) {
    reach_m_ = std::min(reach_m_,
                        kReachSteps * pass_steps_m_[step_place()] + kFacetMargin * scale.margin_m);
  }
  reach_all(tick);
}

/// Takes those pairs in too that a step of this length can meet.
void Proxy::widen(Real motion_m, ProxyTick& tick) noexcept {
  reach_m_ = (has_facets() ? kReachSteps : 4) * motion_m;
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
  drop(active_, [&](const ImposedPlane& plane) { return plane.pair == slot; });
  drop(pending_, [&](const ImposedPlane& plane) { return plane.pair == slot; });
  drop(cones_, [&](const FrictionCone& cone) { return cone.pair == slot; });
  drop(last_cones_, [&](const FrictionCone& cone) { return cone.pair == slot; });
  for (PlaneRegion& region : regions_) {
    if (region.pair == slot) region.version = 0;
  }
}

/// A pair has come to a slot.
void Proxy::enter(std::uint32_t slot) noexcept {
  const NearPair& near = near_pairs_[slot];
  const SceneView& scene = scene_[0];
  const PairRecord record = scene.pair_record(near.pair);
  const PieceRecord& a = scene.pieces()[record.piece_a];
  const BodyRecord& body = scene.bodies()[scene.pieces()[record.piece_b].body];
  ProxyPair& pair = pairs_[slot];
  pair = ProxyPair{};
  pair.index = near.pair;
  for (int k = 0; k < 3; ++k) pair.reference_w[k] = static_cast<Real>(body.reference_m[k]);
  pair.reach_a_m = static_cast<Real>(a.reach_m);
  pair.middle_a = piece_centre(a);
  pair.radius_a_m = static_cast<Real>(a.radius_m) * (1 + kRealEpsilon);
  pair.friction = static_cast<Real>(body.friction);
  pair.friction_static = static_cast<Real>(body.friction_static);
  pair.clear_until_m = list_path_m_ + list_turn_rad_ * static_cast<double>(pair.reach_a_m) +
                       static_cast<double>(near.gap_m - skin_m());
}

/// Goes on with the list of near pairs, or begins one, of those within reach and as far again so
/// that it lasts for a while. Where one list is more than a tick has time for, the next is begun
/// early.
void Proxy::list_pairs(ProxyTick& tick) noexcept {
  if (has_screen()) return renew_screen(tick);
  const ProxyScale& scale = parameters_.scale;
  // For a motion like the last one.
  const Real came_m = std::sqrt(came_.translation_m.squaredNorm());
  const Real came_rad = std::sqrt(came_.rotation_rad.squaredNorm());
  const Real turned_m = parameters_.radius_m * came_rad;
  const Real listed_m = list_motion_m(came_m, came_rad);
  const Real of_list =
      has_long_lists() && listed_m > 0 ? (came_m + turned_m) / listed_m : near_pairs_.least_share();
  const Real clear_m = of_list * unlisted_m();
  // Pairs without a slot that have cut a step may have one in a list made where the part is now.
  const bool cut =
      tick.crowded && has_left_out() && (path_m_ != list_path_m_ || turn_rad_ != list_turn_rad_);
  const bool short_of = cut || !(clear_m >= reach_m_);
  const Real until_made_m = kEarlyTicks * static_cast<Real>(list_ticks_) * tick_motion_m_;
  const bool early = list_ticks_ > 1 && !(clear_m >= reach_m_ + until_made_m);
  if (!short_of && !early && !near_pairs_.is_begun()) return;
  if (!near_pairs_.is_begun()) {
    const Real further_m = has_facets() ? scale.reach_m / 2 : scale.reach_m;
    list_range_m_ = std::min(list_range_m_, reach_m_ + further_m);
    if (has_facets()) list_range_m_ = std::max(list_range_m_, 2 * reach_m_);
    // Of solids without a slot the fewer are near, the sooner the next list is made.
    if (near_pairs_.overflowed() && !has_facets()) list_range_m_ = reach_m_;
    // A part that mostly turns takes less from the gaps of what is near its axis.
    const bool turns = has_long_lists() && came_m <= kTurningShare * turned_m;
    const Real share = turns ? kLeastListShare : Real{1};
    near_pairs_.begin(p_, list_odometer_m(share), list_range_m_, share, parameters_.radius_m);
    list_age_ = 1;
    list_path_m_ = path_m_;
    list_turn_rad_ = turn_rad_;
    // A scene whose lists are never long may make another one.
    if (list_visits_of_tick_ < kListVisitsOfTick && has_budget(tick)) {
      list_visits_left_ = list_visits_of_tick_;
    }
  }
  if (list_visits_left_ == 0) return;
  for (const ReachedPair& reached : reached_) near_pairs_.pin(reached.pair);
  for (const std::uint32_t slot : beside()) near_pairs_.pin(slot);
  const auto go_on = [&](std::uint32_t most_visits) {
    const std::uint32_t before = near_pairs_.visited();
    const bool finished =
        near_pairs_.go_on(most_visits, list_odometer_m(near_pairs_.begun_share()), reach_m_);
    const std::uint32_t visits = near_pairs_.visited() - before;
    list_visits_left_ -= std::min(visits, list_visits_left_);
    tick.list_visits += visits;
    return finished;
  };
  bool finished = go_on(list_visits_left_);
  // Where the part has outrun its list it can but wait: the rest of the tick is for the next one.
  if (!finished && !(unlisted_m() > 2 * scale.still_m) && has_budget(tick)) {
    finished = go_on(kListVisitsOfUnit * (parameters_.work_units - tick.units()));
  }
  if (!finished) return;
  list_ticks_ = has_long_lists() ? list_age_ : near_pairs_.visited() / kListVisitsOfTick + 1;
  list_range_m_ *= near_pairs_.visited() > kLongLists * kListVisitsOfTick ? kTrustLess : kTrustMore;
  for (const std::uint32_t slot : near_pairs_.changed()) {
    forget(slot);
    if (near_pairs_.holds(slot)) enter(slot);
  }
  hot_until_m_ = -std::numeric_limits<double>::max();
}

/// The pairs that a pass looks at one by one: all, or of many those that are near, so that the
/// others cost one comparison together.
std::span<const std::uint32_t> Proxy::hot_pairs() noexcept {
  if (hot_.capacity() == 0) return near_pairs_.slots();
  if (cold_m() >= reach_m_) return hot_.view();
  hot_.clear();
  Real cold_m = std::numeric_limits<Real>::max();
  for (const std::uint32_t slot : near_pairs_.slots()) {
    const ProxyPair& pair = pairs_[slot];
    const Real clear = pair.gap_version == version_ ? pair.gap_m : clear_m(pair);
    if (pair.inside || !(clear >= kHotReaches * reach_m_)) {
      static_cast<void>(hot_.push(slot));
    } else {
      cold_m = std::min(cold_m, clear);
    }
  }
  hot_until_m_ = odometer_m() + static_cast<double>(cold_m);
  return hot_.view();
}

Real Proxy::left_out_m() const noexcept {
  Real gap_m = std::numeric_limits<Real>::max();
  for (const LeftOut& left : near_pairs_.left_out()) gap_m = std::min(gap_m, left.gap_m - skin_m());
  return gap_m;
}

/// Takes a pair that may be within the pass's reach into its lists, once a pass; what its gap is at
/// least, where it was `known_m` before.
Real Proxy::take_in(std::uint32_t slot, Real known_m, ProxyTick& tick) noexcept {
  ProxyPair& pair = pairs_[slot];
  if (pair.reached_in == pass_) return known_m;
  ReachedPair reached;
  if (!reach_pair(pair, reached, tick)) {
    const Real found_m = clear_m(pair);
    tick.gap_m = std::min(tick.gap_m, found_m);
    return found_m;
  }
  reached.pair = slot;
  recall_valid(reached);
  pair.reached_in = pass_;
  worst_gap_m_ = std::min(worst_gap_m_, reached.gap_m);
  if (reached_.push(reached)) {
    need_view(pair, tick);
    keep_view(slot, true);
  } else {
    stand_beside(reached, tick);
  }
  if (pair.inside) {
    // Rounding and what is lower than a step that holds the part are left without a word.
    const Real slight_m = valid_depth(parameters_.scale) + parameters_.scale.climb_m;
    tick.inside = true;
    tick.recovering = tick.recovering || led_out_ || -reached.gap_m > slight_m;
  }
  return reached.gap_m;
}

/// Appends the pairs within the pass's reach that are not in its list yet.
void Proxy::reach_all(ProxyTick& tick) noexcept {
  list_pairs(tick);
  const std::span<const std::uint32_t> slots = hot_pairs();
  nearest_m_ = std::min({near_pairs_.least_share() * unlisted_m(), cold_m(), left_out_m()});
  if (has_screen()) nearest_m_ = std::min(nearest_m_, screen_->nearest_m() - skin_m());
  tick.gap_m = std::max(nearest_m_, Real{0});  // p is free of what no list has shown yet
  const auto known_m = [&](const ProxyPair& pair) {
    return pair.gap_version == version_ ? pair.gap_m : clear_m(pair);
  };
  const auto take_first = [&](const ImposedPlane& plane) {
    const ProxyPair& pair = pairs_[plane.pair];
    const Real clear = known_m(pair);
    if (pair.inside || !(clear >= reach_m_)) {
      nearest_m_ = std::min(nearest_m_, take_in(plane.pair, clear, tick));
    }
  };
  if (takes_turns()) {  // what holds the part comes before the others
    for (const ImposedPlane& plane : active_) take_first(plane);
    for (const ImposedPlane& plane : pending_) take_first(plane);
  }
  Real far_m = std::numeric_limits<Real>::max();  // of all beyond reach
  for (const std::uint32_t slot : slots) {
    const ProxyPair& pair = pairs_[slot];
    const Real clear = known_m(pair);
    if (clear >= reach_m_ && !pair.inside) {
      far_m = std::min(far_m, clear);
    } else {
      nearest_m_ = std::min(nearest_m_, take_in(slot, clear, tick));
    }
  }
  nearest_m_ = std::min(nearest_m_, far_m);
  tick.gap_m = std::min(tick.gap_m, far_m);
}

/// The valid set of a pair, if it has been found at p_.
void Proxy::recall_valid(ReachedPair& reached) const noexcept {
  const std::uint32_t number = pairs_[reached.pair].set;
  if (number >= sets_.size() || sets_[number].pair != reached.pair) return;
  const FoundSet& set = sets_[number];
  reached.searched = true;
  reached.valid_begin = set.begin;
  reached.valid_count = set.count;
  reached.exposed_count = set.exposed;
}

/// The valid set of a pair at p_, once while p_ stays.
void Proxy::find_valid(ReachedPair& reached, ProxyTick& tick) noexcept {
  ProxyPair& pair = pairs_[reached.pair];
  reached.searched = true;
  reached.valid_begin = valid_.size();
  if (valid_.size() == valid_.capacity()) return;  // its certificate stays its only plane
  const auto only = [&] {
    reached.exposed_count = 0;
    if (valid_.push({pair.plane, pair.support, pair.gap_m})) reached.valid_count = 1;
  };
  std::array<ValidPlane, kMaxValidPlanes> planes;
  const Real least = -valid_depth(parameters_.scale);
  const ValidResult found =
      find_valid_planes(pose_of(pair), pair.plane, pair.support, least, valid_scratch_, planes);
  tick.valid_nodes += found.visited;
  for (std::uint32_t k = 0; k < found.count; ++k) {
    if (!valid_.push(planes[k])) break;
  }
  reached.valid_count = valid_.size() - reached.valid_begin;
  reached.exposed_count = std::min(found.exposed, reached.valid_count);
  if (reached.valid_count == 0) {
    search_fully(pair, tick);  // the plane has ceased to be a C-face and none is beside it
    only();
  }
  pair.set = sets_.size();
  static_cast<void>(
      sets_.push({reached.pair, reached.valid_begin, reached.valid_count, reached.exposed_count}));
}

}  // namespace haptic
