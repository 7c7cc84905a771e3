// SPDX-License-Identifier: Apache-2.0
// The proxy's tick: memory, the passes, and how far they may go.

#include "rt_core/proxy/proxy_law.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/contact/piece_sphere.hpp"
#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {
namespace {

/// Share of what is left of the budget that a long list may take, and its most visits in a tick,
/// over those that it always may.
constexpr Real kListSpareShare = 0.3_r;
constexpr std::uint32_t kMostVisitsShare = 3;
/// Among facets a whole step whose turn bends it by no more than so many tolerances is the last of
/// a tick whose goal moves.
constexpr Real kBendTolerances = 4;

constexpr Real kNoLimit = std::numeric_limits<Real>::max();

/// kTrustLess and kTrustMore among facets.
constexpr Real kFacetTrustLess = 0.6_r, kFacetTrustMore = 2;
/// And where they are screened: a part that has rested is in two passes as fast as any.
constexpr Real kScreenTrustMore = 16;
/// A step among facets that takes this share of what it may was bound by that.
constexpr Real kBoundShare = 0.5_r;
/// One that takes this share went no farther for that alone.
constexpr Real kAllOfTrust = 0.999_r;
/// Where lists of near pairs take long, no step is longer than this share of the scale's reach.
constexpr Real kFacetTrust = 0.5_r;

/// Radius of the part for which the lengths below were chosen.
constexpr Real kChosenFor_m = 0.05_r;

/// No lower step between two faces is made on purpose.
constexpr Real kLowStep_m = 5.0e-6_r;

/// Of the ticks with one goal, to the bit, those are counted that lower the energy by less than
/// kOnItsWay of it though the part might have moved farther, less the others: the count after which
/// a step must lower it by more in each, and the one after which it would have to by more than any
/// spring holds.
constexpr Real kOnItsWay = 0.02_r;
constexpr std::uint32_t kPatience = 48, kMostHeld = kPatience + 2 * 128;
/// Passes of a tick that may go no farther than a few times the tolerance.
constexpr std::uint32_t kMostShortPasses = 2;
/// With one goal the planes are chosen from the start in every such tick.
constexpr std::uint32_t kChoicePeriod = 4;
/// Ticks with one goal of which every pass was rejected, after which nothing is tried any more.
constexpr std::uint32_t kLeastHeld = 4;
/// A choice of planes from the start that the budget cuts goes on in the next ticks, up to so many.
constexpr std::uint32_t kMostChoices = 3;

std::uint32_t largest_loop(const PieceView& piece) noexcept {
  std::uint32_t largest = 0;
  for (std::uint32_t f = 0; f < piece.face_count; ++f) {
    largest = std::max(largest, piece.faces[f].loop_count);
  }
  return largest;
}

}  // namespace

SceneSize scene_size(const SceneView& scene) noexcept {
  const auto length_m = [](const double(&v)[3]) {
    return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  };
  double radius = 0, extent = length_m(scene.parameters().start_p_wa_m);
  for (const PieceRecord& piece : scene.pieces()) {
    if (piece.body == 0) {
      radius = std::max(radius, piece.reach_m);
    } else {
      extent = std::max(extent, length_m(scene.bodies()[piece.body].reference_m) + piece.reach_m);
    }
  }
  return {static_cast<Real>(radius), static_cast<Real>(extent)};
}

ProxyScale proxy_scale(const SceneView& scene) noexcept {
  const SceneSize size = scene_size(scene);
  const CouplingParameters& c = scene.parameters().coupling;
  return proxy_scale(size.radius_m, size.extent_m, static_cast<Real>(c.tolerance_m),
                     static_cast<Real>(c.climb_m));
}

ProxyScale proxy_scale(Real radius_m, Real extent_m, Real tolerance_m, Real climb_m) noexcept {
  const Real share = radius_m / kChosenFor_m;
  const Real floor_m = 64 * kRealEpsilon * (radius_m + extent_m);
  ProxyScale scale;
  scale.tolerance_m = std::max(tolerance_m > 0 ? tolerance_m : 1.0e-7_r * share, floor_m);
  // Depths that count as free, at the start of a step and on its way, leave a gap of it.
  scale.skin_m = 2 * scale.tolerance_m;
  scale.step_m = 2.0e-3_r * share;
  scale.turn_rad = 0.02_r;
  scale.margin_m = 1.0e-4_r * share;
  scale.manifold_m = 2.0e-3_r * share;
  scale.reach_m = scale.step_m + scale.turn_rad * radius_m + scale.margin_m;
  scale.recovery_step_m = 2.0e-4_r * share;
  const Real low_m = std::min(std::max(kLowStep_m, 10 * scale.tolerance_m), radius_m / 1000);
  scale.climb_m = climb_m > 0 ? climb_m : climb_m < 0 ? Real{0} : low_m;
  scale.still_m = std::max(1.0e-9_r * share, floor_m / 64);
  scale.still_rad = scale.still_m / std::max(radius_m, std::numeric_limits<Real>::min());
  scale.last_m = 100 * scale.still_m;
  scale.last_rad = 100 * scale.still_rad;
  return scale;
}

void Proxy::place(Arena& arena, const SceneView& scene) noexcept {
  const SceneCapacity& c = scene.header().capacity;
  const std::uint32_t moving_pieces = scene.bodies()[0].piece_count;
  std::uint32_t loop_a = 0, loop_b = 0;
  Arena counting;
  FeatureBounds bounds;
  bounds.place(counting, largest_counts(scene.pieces().first(moving_pieces)),
               largest_counts(scene.pieces().subspan(moving_pieces)));
  const std::size_t search_bytes = counting.used();
  for (std::uint32_t i = 0; i < scene.pieces().size(); ++i) {
    std::uint32_t& loop = i < moving_pieces ? loop_a : loop_b;
    loop = std::max(loop, largest_loop(scene.piece(i)));
  }
  const std::uint32_t slots = c.near_slots;
  scene_ = arena.take<SceneView>(1);
  settled_tick_ = arena.take<ProxyTick>(1).data();
  felt_ = arena.take<FeltContact>(1);
  const bool screened = FacetScreen::serves(scene);
  near_pairs_.place(arena, scene, slots, screened);
  if (screened) {
    screen_ = arena.take<FacetScreen>(1).data();
    FacetScreen unplaced;
    (screen_ == nullptr ? unplaced : *screen_).place(arena, scene);
  }
  has_facets_ = scene.has_facets();
  if (!screened && (has_facets_ || slots > kManyNearPairs)) {
    hot_ = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(slots));
  }
  const bool overflows = !screened && c.pair_count > slots;
  list_visits_of_tick_ = static_cast<std::uint32_t>(
      list_visits(moving_pieces, scene.pieces().size() - moving_pieces, overflows));
  pairs_ = arena.take<ProxyPair>(slots);
  const NearSeats seats = near_seats(slots, scene.parameters().coupling.near_pairs);
  views_ = arena.take<PairView>(seats.views);
  view_of_ = arena.take<ViewPlace>(seats.take_turns ? seats.views : 0);
  reached_ = BoundedList<ReachedPair>(arena.take<ReachedPair>(seats.seats));
  beside_ = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(seats.take_turns ? slots : 0));
  const std::uint32_t searches = std::min(slots, kMaxValidSearches);
  valid_ = BoundedList<ValidPlane>(arena.take<ValidPlane>(std::size_t{searches} * kMaxValidPlanes));
  sets_ = BoundedList<FoundSet>(arena.take<FoundSet>(slots));
  imposed_ = BoundedList<ImposedPlane>(arena.take<ImposedPlane>(kMaxImposedPlanes));
  active_ = BoundedList<ImposedPlane>(arena.take<ImposedPlane>(kMaxFeltPlanes));
  pending_ = BoundedList<ImposedPlane>(arena.take<ImposedPlane>(kMaxImposedPlanes));
  rows_ = BoundedList<QpRow>(arena.take<QpRow>(kMaxQpRows));
  row_plane_ = arena.take<std::uint8_t>(kMaxQpRows);
  regions_ = arena.take<PlaneRegion>(kKeptRegions);
  bool rubbing = false;
  for (const BodyRecord& body : scene.bodies()) rubbing = rubbing || body.friction > 0;
  if (kSceneTraits.friction && rubbing) {
    cones_ = BoundedList<FrictionCone>(arena.take<FrictionCone>(kMaxFrictionCones));
    row_cone_ = arena.take<std::uint8_t>(kMaxQpRows);
    last_cones_ = BoundedList<FrictionCone>(arena.take<FrictionCone>(kMaxFrictionCones));
  }
  lanes_ = arena.take<Real>(3 * std::size_t{c.moving_lanes});
  lanes_begin_ = arena.take<std::size_t>(moving_pieces);
  lanes_version_ = arena.take<std::uint64_t>(moving_pieces);
  search_memory_ = arena.take<std::uint64_t>((search_bytes + 7) / 8);
  valid_scratch_.place(arena);
  manifold_scratch_.place(arena, loop_a, loop_b);
  if (lanes_begin_.empty()) return;
  std::size_t lanes = 0;
  for (std::uint32_t i = 0; i < moving_pieces; ++i) {
    lanes_begin_[i] = lanes;
    lanes += 3 * std::size_t{scene.pieces()[i].lane_count};
  }
}

void Proxy::read_scene(const SceneView& scene) noexcept {
  scene_[0] = scene;
  near_pairs_.read_scene(scene_[0]);
  if (has_screen()) screen_->read_scene(scene_[0]);
}

void Proxy::reset() noexcept {
  started_ = false;
  near_pairs_.reset();
  if (has_screen()) screen_->reset();
  for (ViewPlace& place : view_of_) place = {};
  next_view_ = next_seat_ = 0;
  cones_.clear();
  last_cones_.clear();
  for (std::uint64_t& version : lanes_version_) version = 0;
  active_.clear();
  pending_.clear();
  trust_m_ = most_trust_m();
  list_range_m_ = kNoLimit;
  list_ticks_ = 1;
  list_age_ = 0;
  pass_units_ = 0;
  hot_.clear();
  hot_until_m_ = -std::numeric_limits<double>::max();
  pass_steps_m_ = {};
  tick_motion_m_ = 0;
  tick_start_m_ = 0;
  waiting_ = waited_ = false;
  behind_ticks_ = 0;
  choose_from_start_ = false;
  settled_ = still_ = choice_spent_ = false;
  held_ = slow_ = 0;
  chosen_planes_ = 0;
  chosen_ago_ = 0;
  felt_[0] = FeltContact{};
  way_out_w_.setZero();
  short_ways_ = 0;
  climbed_count_ = climbing_ = 0;
  tried_m_ = 0;
  no_low_until_m_ = 0;
  wedged_ = has_wish_ = keeps_active_ = short_ = far_rows_ = longest_ = moved_little_ = false;
  for (PlaneRegion& region : regions_) region.version = 0;
  oldest_region_ = 0;
  path_m_ = turn_rad_ = 0;
  version_ = 1;
  sets_version_ = 0;
}

/// Whether a tick may begin something that costs more than a gap. The first of its kind it always
/// may.
bool Proxy::may_begin(Grant grant, ProxyTick& tick) noexcept {
  const bool first = (grants_ & grant) == 0;
  grants_ = static_cast<std::uint8_t>(grants_ | grant);
  if (first || has_budget(tick)) return true;
  tick.spent = true;
  return false;
}

/// What a pass must lower the energy by to be worth a step: what rounding makes of it, and where
/// the goal has stayed the same for long more and more, so that every search ends.
Real Proxy::least_fall_j(Real potential_j) const noexcept {
  const Real still_m = parameters_.scale.still_m;
  Real fall_j =
      parameters_.spring.k_t_n_per_m * still_m * still_m / 2 + 32 * kRealEpsilon * potential_j;
  for (std::uint32_t k = kPatience; k < std::min(slow_, kMostHeld); k += 2) fall_j *= 2;
  return fall_j;
}

/// Another plane than its own that certifies a pair at p becomes its own.
void Proxy::keep_plane(const ReachedPair& reached) noexcept {
  // A plane that p is as deep behind as no step may end would hold it there.
  const Real least = -parameters_.scale.tolerance_m / 2;
  ProxyPair& pair = pairs_[reached.pair];
  if (reached.unsure || pair.inside || reached.plane == pair.plane || reached.gap_p_m < least) {
    return;
  }
  pair.plane = reached.plane;
  pair.support = reached.support;
  pair.gap_m = reached.gap_p_m;
  pair.gap_version = version_;
  pair.has_held = false;
}

/// A pass has ended for want of budget: p_ stays, the next one goes on with what this has found, no
/// farther than a part of the way.
void Proxy::keep_found() noexcept {
  for (const ReachedPair& reached : reached_) keep_plane(reached);
  pending_.clear();
  for (const ImposedPlane& plane : imposed_) static_cast<void>(pending_.push(plane));
  const Real less = has_facets() ? kFacetTrustLess : kTrustLess;
  trust_m_ = std::max(less * std::min(trust_m_, reach_m_),
                      kLastTolerances * parameters_.scale.tolerance_m);
}

Real Proxy::most_trust_m() const noexcept {
  return has_long_lists() ? kFacetTrust * parameters_.scale.reach_m : kNoLimit;
}

/// The longest step of the next pass, by how this one has ended. Among facets a step that asks for
/// more than the planes of one place can tell is rejected, and a shorter one finds its way.
void Proxy::adapt_trust(PassEnd end) noexcept {
  if (has_facets()) {
    const bool was_bound = tried_m_ >= kBoundShare * trust_m_;
    const Real more = has_screen() ? kScreenTrustMore : kFacetTrustMore;
    if (end == PassEnd::kMoved && was_bound) trust_m_ *= more;
    // What a part at rest tried of rounding's size says nothing of longer steps.
    const bool is_told = tried_m_ > parameters_.scale.last_m || !(tried_m_ < trust_m_);
    if (end == PassEnd::kRejected && is_told) {
      trust_m_ = std::max(kTrustLess * std::min(trust_m_, tried_m_),
                          kLastTolerances * parameters_.scale.tolerance_m);
    }
    trust_m_ = std::min(trust_m_, most_trust_m());
  } else if (end == PassEnd::kMoved && trust_m_ < kNoLimit) {
    trust_m_ *= kTrustMore;
    if (trust_m_ > parameters_.scale.reach_m) trust_m_ = kNoLimit;
  }
}

/// Moves p_ to the end of `step`, which every reached pair has certified.
void Proxy::accept(const Step& step) noexcept {
  note_slip(step);
  near_pairs_.follow(step.dx_m, step.dtheta_rad);
  if (has_screen()) {
    screen_->accept(step.q, std::sqrt(step.dx_m.squaredNorm()),
                    std::sqrt(step.dtheta_rad.squaredNorm()));
  }
  way_.translation_m -= step.dx_m;
  way_.rotation_rad -= step.dtheta_rad;
  if (pass_of_tick_ == 0) came_ = {step.dx_m, step.dtheta_rad};
  const ProxyScale& scale = parameters_.scale;
  moved_little_ = step.dx_m.squaredNorm() <= scale.last_m * scale.last_m &&
                  step.dtheta_rad.squaredNorm() <= scale.last_rad * scale.last_rad;
  // Of a whole step what a turn bends is left.
  const Real bend_m = parameters_.radius_m * step.dtheta_rad.squaredNorm() / 2;
  if (has_long_lists() && whole_ && bend_m <= kBendTolerances * scale.tolerance_m)
    moved_little_ = true;
  way_left_m_ = std::max(way_left_m_ - std::sqrt(step.dx_m.squaredNorm()), Real{0});
  turn_left_rad_ = std::max(turn_left_rad_ - std::sqrt(step.dtheta_rad.squaredNorm()), Real{0});
  Real& step_m = pass_steps_m_[step_place()];
  step_m =
      std::max(step_m / 2, std::sqrt(step.dx_m.squaredNorm()) +
                               parameters_.radius_m * std::sqrt(step.dtheta_rad.squaredNorm()));
  p_ = step.q;
  version_ += 1;
  path_m_ = (path_m_ + static_cast<double>(std::sqrt(step.dx_m.squaredNorm())) * kOdometerUp) *
            (1 + 0x1p-52);
  if (!is_locked())
    turn_rad_ =
        (turn_rad_ + static_cast<double>(std::sqrt(step.dtheta_rad.squaredNorm())) * kOdometerUp) *
        (1 + 0x1p-52);
  for (const ReachedPair& reached : reached_) {
    ProxyPair& pair = pairs_[reached.pair];
    pair.plane = reached.plane;
    pair.support = reached.support;
    if (kSceneTraits.facets && reached.shared) {
      hold(pair, reached.normal_q_w, reached.gap_q_m);
      pair.clear_until_m =
          odometer_m(pair) +
          static_cast<double>(reached.gap_q_m -
                              gap_rounding(*pair.view, Vec3(p_.x0_w - pair.reference_w)));
    } else if (!reached.exact_q) {
      // A plane of A, or of two edges, turns away from the direction that was held.
      if (pair.has_held && pair.plane.type == ContactType::kB) {
        pair.clear_until_m =
            std::max(pair.clear_until_m, odometer_m(pair) + static_cast<double>(reached.gap_q_m));
      }
    } else {
      hold(pair, reached.normal_q_w, reached.gap_q_m);
      pair.gap_m = reached.gap_q_m;
      pair.gap_version = version_;
      pair.clear_until_m =
          odometer_m(pair) +
          static_cast<double>(pair.gap_m -
                              gap_rounding(*pair.view, Vec3(p_.x0_w - pair.reference_w)));
    }
  }
}

ProxyTick Proxy::tick(const GripPose& goal, NearScratch& scratch) noexcept {
  near_scratch_ = &scratch;
  grants_ = 0;
  list_visits_left_ = list_visits_of_tick_;
  list_age_ += 1;
  // What the passes of the last ticks have left of the budget is for a long list.
  if (has_long_lists() && pass_units_ < parameters_.work_units) {
    const Real spare =
        kListSpareShare * kListVisitsOfUnit * static_cast<Real>(parameters_.work_units - pass_units_);
    list_visits_left_ = std::clamp(static_cast<std::uint32_t>(spare), list_visits_of_tick_,
                                   kMostVisitsShare * list_visits_of_tick_);
  }
  if (has_left_out()) {  // gaps along faces leave the passes half of the budget
    list_visits_left_ =
        std::min(list_visits_left_, kListVisitsOfUnit * (parameters_.work_units / 2));
  }
  waited_ = waiting_;
  waiting_ = false;
  if (!started_) {
    p_ = goal_ = goal;
    started_ = led_out_ = true;
    version_ += 1;
    held_ = 0;
  } else if (goal.x0_w == goal_.x0_w && goal.q_wa.coeffs() == goal_.q_wa.coeffs()) {
    if (settled_) {
      settle_slip();
      return settled_tick_[0];
    }
    held_ = std::min(held_ + 1, kMostHeld);
    // Planes of an earlier pass can make a long way slow.
    if (behind_ticks_ == 0 && !choice_spent_ && !sticks() &&
        (still_ || held_ % kChoicePeriod == 0)) {
      choose_from_start_ = true;
    }
  } else {
    held_ = 0;
    choice_spent_ = false;
  }
  const bool chosen = choose_from_start_ || sticks();
  bound_move(goal);
  if (has_friction()) {
    const PoseError way = error_of(goal, goal_);
    if (behind_ticks_ == 0) way_ = PoseError{};
    way_.translation_m += way.translation_m;
    way_.rotation_rad += way.rotation_rad;
  }
  goal_ = goal;
  const double odometer = odometer_m();
  tick_motion_m_ = std::max(tick_motion_m_ / 2, static_cast<Real>(odometer - tick_start_m_));
  tick_start_m_ = odometer;
  longest_ = false;
  ProxyTick tick;
  tick.start_potential_j = potential_j(parameters_.spring, error_of(goal, p_));
  tick.end_potential_j = tick.start_potential_j;
  granted_lists_ = granted_planes_ = kGrantedScreenWork;
  if (has_screen()) give_back(tick);
  may_close_ = true;
  PassEnd end = PassEnd::kMoved;
  std::uint32_t short_passes = 0;
  bool was_bound = false;  // the last pass: by how far a step is trusted
  list_cut_ = false;
  for (std::uint32_t k = 0; k < parameters_.passes; ++k) {
    pass_of_tick_ = k;
    end = pass(goal, tick);
    tick.passes += 1;
    tick.moved = tick.moved || end == PassEnd::kMoved;
    if (k == 0 && end != PassEnd::kMoved) came_ = PoseError{};
    if (end == PassEnd::kSpent) {
      keep_found();
      break;
    }
    pending_.clear();
    was_bound = has_screen() && tried_m_ >= kAllOfTrust * trust_m_;
    adapt_trust(end);
    if (end == PassEnd::kDone || !may_move()) break;
    if (end == PassEnd::kMoved && held_ == 0 && moved_little_) break;
    // The planes that a short step has found may lead farther; a second one says that they do not.
    if (short_ && ++short_passes == kMostShortPasses) break;
    if (!has_budget(tick)) {
      tick.spent = tick.spent || end == PassEnd::kMoved;
      break;
    }
  }
  // With one pass in a tick its way is straight.
  // What goes all the way with the goal is not held by a low step.
  const bool follows = has_long_lists() && end == PassEnd::kMoved && whole_ && held_ == 0;
  if (end != PassEnd::kSpent && parameters_.passes > 1 && !follows) {
    if (climb(goal, tick)) {
      end = PassEnd::kMoved;
      tick.moved = true;
    }
  }
  // The list of near pairs has been outrun, or the passes have ended before a screened part was as
  // fast as it asks to be.
  if (list_cut_ && tick.moved) tick.spent = true;
  if (was_bound && end == PassEnd::kMoved && tick.passes == parameters_.passes) tick.spent = true;
  behind_ticks_ = tick.spent ? behind_ticks_ + 1 : 0;
  tick.behind_ticks = behind_ticks_;
  choice_spent_ = !tick.moved && (choice_spent_ || (chosen && tick.spent));
  if (tick.residual_n > kResidual_n || choice_spent_) tick.limited = true;
  tick.error = error_of(goal, p_);
  for (const ReachedPair& reached : reached_) {
    const ProxyPair& pair = pairs_[reached.pair];
    const bool accepted = pair.gap_version == version_;
    Real gap_m = accepted ? pair.gap_m : reached.gap_q_m;
    if (!accepted && end != PassEnd::kMoved) gap_m = reached.gap_m;  // p has stayed
    // Its plane has passed, and there was no budget for another: p is free all the same.
    if (reached.unsure) gap_m = std::max(gap_m, Real{0});
    tick.gap_m = std::min(tick.gap_m, gap_m);
  }
  for (const std::uint32_t slot : beside()) {  // certified, where its gap was not looked at again
    tick.gap_m = std::min(tick.gap_m, std::max(seen(slot).gap_m, -parameters_.scale.tolerance_m));
  }
  pass_units_ = std::max(pass_units_ / 2, tick.units() - tick.list_visits / kListVisitsOfUnit);
  settle_slip();
  feel(tick);
  if (!tick.inside && !waiting_ && unlisted_m() > 0) led_out_ = false;
  still_ =
      !tick.moved && !tick.inside && !tick.spent && (end == PassEnd::kDone || held_ >= kLeastHeld);
  // Only with planes that this tick has chosen from the start, to the end; else the next one with
  // this goal does, or goes on with it.
  settled_ = still_ && chosen && (!keeps_active_ || held_ >= kMostChoices);
  // A part that is on its way, however long that takes, is not one that looks for its place.
  const bool gains = !may_move() || (tick.moved && longest_) ||
                     tick.end_potential_j < (1 - kOnItsWay) * tick.start_potential_j;
  slow_ = held_ == 0 ? 0 : gains ? slow_ - (slow_ > 0) : std::min(slow_ + 1, kMostHeld);
  if (settled_) {
    ProxyTick& settled = settled_tick_[0] = tick;
    settled.passes = settled.rejected = 0;
    settled.rounds = settled.rows = settled.qp_iterations = 0;
    settled.plane_gaps = settled.valid_nodes = settled.full_searches = 0;
    settled.search_work = settled.qp_programs = settled.qp_steps = settled.balances = 0;
    settled.regions = 0;
  }
  return tick;
}

}  // namespace haptic
