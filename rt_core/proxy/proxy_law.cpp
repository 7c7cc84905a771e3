// SPDX-License-Identifier: Apache-2.0
// The proxy's tick: memory, the passes, and how far they may go.

#include "rt_core/proxy/proxy_law.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/contact/piece_sphere.hpp"
#include "rt_core/proxy/pass_numbers.hpp"
#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {
namespace {

/// Share of what is left of the budget that a long list may take, and its most visits in a tick,
/// over those that it always may.
constexpr Real kListSpareShare = 0.3_r;
constexpr std::uint32_t kMostVisitsShare = 3;
/// Among facets a whole step whose turn bends it by no more than so many tolerances is the last of
/// a tick whose goal moves.
constexpr Real kBendTolerances = 2;

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

/// Passes of a tick that may go no farther than a few times the tolerance.
constexpr std::uint32_t kMostShortPasses = 2;
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
  near_.scene = arena.take<SceneView>(1);
  rest_.settled_tick = arena.take<ProxyTick>(1).data();
  felt_ = arena.take<FeltContact>(1);
  const bool screened = FacetScreen::serves(scene);
  near_.list.place(arena, scene, slots, screened);
  if (screened) {
    near_.screen = arena.take<FacetScreen>(1).data();
    FacetScreen unplaced;
    (near_.screen == nullptr ? unplaced : *near_.screen).place(arena, scene);
  }
  near_.has_facets = scene.has_facets();
  if (!screened && (near_.has_facets || slots > kManyNearPairs)) {
    near_.hot = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(slots));
  }
  const bool overflows = !screened && c.pair_count > slots;
  range_.visits_of_tick = static_cast<std::uint32_t>(
      list_visits(moving_pieces, scene.pieces().size() - moving_pieces, overflows));
  near_.pairs = arena.take<ProxyPair>(slots);
  const NearSeats seats = near_seats(slots, scene.parameters().coupling.near_pairs);
  near_.views = arena.take<PairView>(seats.views);
  near_.view_of = arena.take<ViewPlace>(seats.take_turns ? seats.views : 0);
  pass_.reached = BoundedList<ReachedPair>(arena.take<ReachedPair>(seats.seats));
  pass_.beside =
      BoundedList<std::uint32_t>(arena.take<std::uint32_t>(seats.take_turns ? slots : 0));
  const std::uint32_t searches = std::min(slots, kMaxValidSearches);
  found_.valid =
      BoundedList<ValidPlane>(arena.take<ValidPlane>(std::size_t{searches} * kMaxValidPlanes));
  found_.sets = BoundedList<FoundSet>(arena.take<FoundSet>(slots));
  program_.imposed = BoundedList<ImposedPlane>(arena.take<ImposedPlane>(kMaxImposedPlanes));
  kept_.active = BoundedList<ImposedPlane>(arena.take<ImposedPlane>(kMaxFeltPlanes));
  kept_.pending = BoundedList<ImposedPlane>(arena.take<ImposedPlane>(kMaxImposedPlanes));
  program_.rows = BoundedList<QpRow>(arena.take<QpRow>(kMaxQpRows));
  program_.row_plane = arena.take<std::uint8_t>(kMaxQpRows);
  part_.regions = arena.take<PlaneRegion>(kKeptRegions);
  bool rubbing = false;
  for (const BodyRecord& body : scene.bodies()) rubbing = rubbing || body.friction > 0;
  if (kSceneTraits.friction && rubbing) {
    program_.cones = BoundedList<FrictionCone>(arena.take<FrictionCone>(kMaxFrictionCones));
    program_.row_cone = arena.take<std::uint8_t>(kMaxQpRows);
    slip_.last_cones = BoundedList<FrictionCone>(arena.take<FrictionCone>(kMaxFrictionCones));
  }
  part_.lanes = arena.take<Real>(3 * std::size_t{c.moving_lanes});
  part_.lanes_begin = arena.take<std::size_t>(moving_pieces);
  part_.lanes_version = arena.take<std::uint64_t>(moving_pieces);
  scratch_.search_memory = arena.take<std::uint64_t>((search_bytes + 7) / 8);
  scratch_.valid.place(arena);
  scratch_.manifold.place(arena, loop_a, loop_b);
  if (part_.lanes_begin.empty()) return;
  std::size_t lanes = 0;
  for (std::uint32_t i = 0; i < moving_pieces; ++i) {
    part_.lanes_begin[i] = lanes;
    lanes += 3 * std::size_t{scene.pieces()[i].lane_count};
  }
}

void Proxy::read_scene(const SceneView& scene) noexcept {
  near_.scene[0] = scene;
  near_.list.read_scene(near_.scene[0]);
  if (has_screen()) near_.screen->read_scene(near_.scene[0]);
}

void Proxy::reset() noexcept {
  started_ = false;
  near_.list.reset();
  if (has_screen()) near_.screen->reset();
  for (ViewPlace& place : near_.view_of) place = {};
  near_.next_view = near_.next_seat = 0;
  program_.cones.clear();
  slip_.last_cones.clear();
  for (std::uint64_t& version : part_.lanes_version) version = 0;
  kept_.active.clear();
  kept_.pending.clear();
  range_.trust_m = most_trust_m();
  range_.list_m = kNoLimit;
  range_.list_ticks = 1;
  range_.list_age = 0;
  range_.pass_units = 0;
  near_.hot.clear();
  near_.hot_until_m = -std::numeric_limits<double>::max();
  near_.pass_steps_m = {};
  near_.tick_motion_m = 0;
  near_.tick_start_m = 0;
  near_.waiting = near_.waited = false;
  move_.behind_ticks = 0;
  rest_.choose_from_start = false;
  rest_.settled = rest_.still = rest_.choice_spent = false;
  rest_.held = rest_.slow = 0;
  rest_.chosen_planes = 0;
  rest_.chosen_ago = 0;
  felt_[0] = FeltContact{};
  out_.way_w.setZero();
  out_.short_ways = 0;
  climb_.pair_count = climb_.leg = 0;
  pass_.tried_m = 0;
  climb_.no_low_until_m = 0;
  slip_.wedged = program_.has_wish = pass_.keeps_active = pass_.is_short = program_.far_rows =
      move_.longest = move_.moved_little = false;
  for (PlaneRegion& region : part_.regions) region.version = 0;
  part_.oldest_region = 0;
  part_.path_m = part_.turn_rad = 0;
  part_.version = 1;
  found_.sets_version = 0;
}

/// True if a tick may begin something that costs more than a gap. The first of its kind it always
/// may.
bool Proxy::may_begin(Grant grant, ProxyTick& tick) noexcept {
  const bool first = (move_.grants & grant) == 0;
  move_.grants = static_cast<std::uint8_t>(move_.grants | grant);
  if (first || has_budget(tick)) return true;
  move_.spent = true;
  return false;
}

/// What a pass must lower the energy by to be worth a step: what rounding makes of it, and where
/// the goal has stayed the same for long more and more, so that every search ends.
Real Proxy::least_fall_j(Real potential_j) const noexcept {
  const Real still_m = parameters_.scale.still_m;
  Real fall_j =
      parameters_.spring.k_t_n_per_m * still_m * still_m / 2 + 32 * kRealEpsilon * potential_j;
  for (std::uint32_t k = kPatience; k < std::min(rest_.slow, kMostHeld); k += 2) fall_j *= 2;
  return fall_j;
}

/// Another plane than its own that certifies a pair at p becomes its own.
void Proxy::keep_plane(const ReachedPair& reached) noexcept {
  // A plane that p is as deep behind as no step may end would hold it there.
  const Real least = -parameters_.scale.tolerance_m / 2;
  ProxyPair& pair = near_.pairs[reached.pair];
  if (reached.unsure || pair.inside || reached.plane == pair.plane || reached.gap_p_m < least) {
    return;
  }
  pair.plane = reached.plane;
  pair.support = reached.support;
  pair.gap_m = reached.gap_p_m;
  pair.gap_version = part_.version;
  pair.has_held = false;
}

/// A pass has ended for want of budget: p stays, the next one goes on with what this has found, no
/// farther than a part of the way.
void Proxy::keep_found() noexcept {
  for (const ReachedPair& reached : pass_.reached) keep_plane(reached);
  kept_.pending.clear();
  for (const ImposedPlane& plane : program_.imposed) static_cast<void>(kept_.pending.push(plane));
  const Real less = has_facets() ? kFacetTrustLess : kTrustLess;
  range_.trust_m = std::max(less * std::min(range_.trust_m, pass_.reach_m),
                            kLastTolerances * parameters_.scale.tolerance_m);
}

Real Proxy::most_trust_m() const noexcept {
  return has_long_lists() ? kFacetTrust * parameters_.scale.reach_m : kNoLimit;
}

/// The longest step of the next pass, by how this one has ended. Among facets a step that asks for
/// more than the planes of one place can tell is rejected, and a shorter one finds its way.
void Proxy::adapt_trust(PassEnd end) noexcept {
  if (has_facets()) {
    const bool was_bound = pass_.tried_m >= kBoundShare * range_.trust_m;
    const Real more = has_screen() ? kScreenTrustMore : kFacetTrustMore;
    if (end == PassEnd::kMoved && was_bound) range_.trust_m *= more;
    // What a part at rest tried of rounding's size says nothing of longer steps.
    const bool is_told =
        pass_.tried_m > parameters_.scale.last_m || !(pass_.tried_m < range_.trust_m);
    if (end == PassEnd::kRejected && is_told) {
      range_.trust_m = std::max(kTrustLess * std::min(range_.trust_m, pass_.tried_m),
                                kLastTolerances * parameters_.scale.tolerance_m);
    }
    range_.trust_m = std::min(range_.trust_m, most_trust_m());
  } else if (end == PassEnd::kMoved && range_.trust_m < kNoLimit) {
    range_.trust_m *= kTrustMore;
    if (range_.trust_m > parameters_.scale.reach_m) range_.trust_m = kNoLimit;
  }
}

/// Moves p to the end of `step`, which every reached pair has certified.
void Proxy::accept(const Step& step) noexcept {
  note_slip(step);
  near_.list.follow(step.dx_m, step.dtheta_rad);
  if (has_screen()) {
    near_.screen->accept(step.q, std::sqrt(step.dx_m.squaredNorm()),
                         std::sqrt(step.dtheta_rad.squaredNorm()));
  }
  slip_.way.translation_m -= step.dx_m;
  slip_.way.rotation_rad -= step.dtheta_rad;
  if (move_.pass_of_tick == 0) slip_.came = {step.dx_m, step.dtheta_rad};
  const ProxyScale& scale = parameters_.scale;
  move_.moved_little = step.dx_m.squaredNorm() <= scale.last_m * scale.last_m &&
                       step.dtheta_rad.squaredNorm() <= scale.last_rad * scale.last_rad;
  // Of a whole step what a turn bends is left.
  const Real bend_m = parameters_.radius_m * step.dtheta_rad.squaredNorm() / 2;
  if (has_long_lists() && pass_.whole && bend_m <= kBendTolerances * scale.tolerance_m)
    move_.moved_little = true;
  move_.way_left_m = std::max(move_.way_left_m - std::sqrt(step.dx_m.squaredNorm()), Real{0});
  move_.turn_left_rad =
      std::max(move_.turn_left_rad - std::sqrt(step.dtheta_rad.squaredNorm()), Real{0});
  Real& step_m = near_.pass_steps_m[step_place()];
  step_m =
      std::max(step_m / 2, std::sqrt(step.dx_m.squaredNorm()) +
                               parameters_.radius_m * std::sqrt(step.dtheta_rad.squaredNorm()));
  part_.pose = step.q;
  part_.version += 1;
  part_.path_m =
      (part_.path_m + static_cast<double>(std::sqrt(step.dx_m.squaredNorm())) * kOdometerUp) *
      (1 + 0x1p-52);
  if (!is_locked())
    part_.turn_rad = (part_.turn_rad +
                      static_cast<double>(std::sqrt(step.dtheta_rad.squaredNorm())) * kOdometerUp) *
                     (1 + 0x1p-52);
  for (const ReachedPair& reached : pass_.reached) {
    ProxyPair& pair = near_.pairs[reached.pair];
    pair.plane = reached.plane;
    pair.support = reached.support;
    if (kSceneTraits.facets && reached.shared) {
      hold(pair, reached.normal_q_w, reached.gap_q_m);
      pair.clear_until_m =
          odometer_m(pair) +
          static_cast<double>(reached.gap_q_m - gap_rounding(pair_at(pair, part_.pose)));
    } else if (!reached.exact_q) {
      // A plane of A, or of two edges, turns away from the direction that was held.
      if (pair.has_held && pair.plane.type == ContactType::kB) {
        pair.clear_until_m =
            std::max(pair.clear_until_m, odometer_m(pair) + static_cast<double>(reached.gap_q_m));
      }
    } else {
      hold(pair, reached.normal_q_w, reached.gap_q_m);
      pair.gap_m = reached.gap_q_m;
      pair.gap_version = part_.version;
      pair.clear_until_m =
          odometer_m(pair) +
          static_cast<double>(pair.gap_m - gap_rounding(pair_at(pair, part_.pose)));
    }
  }
}

/// What lists of near pairs may look at in this tick.
void Proxy::begin_lists() noexcept {
  std::uint32_t& left = move_.list_visits_left;
  left = range_.visits_of_tick;
  range_.list_age += 1;
  // What the passes of the last ticks have left of the budget is for a long list.
  if (has_long_lists() && range_.pass_units < parameters_.work_units) {
    const Real spare = kListSpareShare * kListVisitsOfUnit *
                       static_cast<Real>(parameters_.work_units - range_.pass_units);
    left = std::clamp(static_cast<std::uint32_t>(spare), range_.visits_of_tick,
                      kMostVisitsShare * range_.visits_of_tick);
  }
  if (has_left_out()) {  // gaps along faces leave the passes half of the budget
    left = std::min(left, kListVisitsOfUnit * (parameters_.work_units / 2));
  }
}

/// Compares the goal with the last one; true: nothing is computed any more until it moves.
bool Proxy::begin_rest(const GripPose& goal) noexcept {
  if (!started_) {
    part_.pose = rest_.goal = goal;
    started_ = out_.led_out = true;
    part_.version += 1;
    rest_.held = 0;
    return false;
  }
  if (!(goal.x0_w == rest_.goal.x0_w && goal.q_wa.coeffs() == rest_.goal.q_wa.coeffs())) {
    rest_.held = 0;
    rest_.choice_spent = false;
    return false;
  }
  if (rest_.settled) return true;
  rest_.held = std::min(rest_.held + 1, kMostHeld);
  // Planes of an earlier pass can make a long way slow.
  if (move_.behind_ticks == 0 && !rest_.choice_spent && !sticks() &&
      (rest_.still || rest_.held % kChoicePeriod == 0)) {
    rest_.choose_from_start = true;
  }
  return false;
}

/// What p may move by, and what the tick may begin.
ProxyTick Proxy::begin_tick(const GripPose& goal) noexcept {
  bound_move(goal);
  if (has_friction()) {
    const PoseError way = error_of(goal, rest_.goal);
    if (move_.behind_ticks == 0) slip_.way = PoseError{};
    slip_.way.translation_m += way.translation_m;
    slip_.way.rotation_rad += way.rotation_rad;
  }
  rest_.goal = goal;
  const double odometer = odometer_m();
  near_.tick_motion_m =
      std::max(near_.tick_motion_m / 2, static_cast<Real>(odometer - near_.tick_start_m));
  near_.tick_start_m = odometer;
  move_.longest = move_.spent = false;
  pass_.inside = pass_.recovering = false;
  ProxyTick tick;
  tick.start_potential_j = potential_j(parameters_.spring, error_of(goal, part_.pose));
  tick.end_potential_j = tick.start_potential_j;
  move_.granted_lists = move_.granted_planes = kGrantedScreenWork;
  if (has_screen()) give_back(tick);
  move_.may_close = true;
  move_.list_cut = false;
  return tick;
}

/// The passes of a tick, until one ends it; @return how the last one ended.
Proxy::PassEnd Proxy::make_passes(const GripPose& goal, ProxyTick& tick) noexcept {
  PassEnd end = PassEnd::kMoved;
  std::uint32_t short_passes = 0;
  bool was_bound = false;  // the last pass: by how far a step is trusted
  for (std::uint32_t k = 0; k < parameters_.passes; ++k) {
    move_.pass_of_tick = k;
    end = pass(goal, tick);
    tick.work.passes += 1;
    tick.moved = tick.moved || end == PassEnd::kMoved;
    if (k == 0 && end != PassEnd::kMoved) slip_.came = PoseError{};
    if (end == PassEnd::kSpent) {
      keep_found();
      break;
    }
    kept_.pending.clear();
    was_bound = has_screen() && pass_.tried_m >= kAllOfTrust * range_.trust_m;
    adapt_trust(end);
    if (end == PassEnd::kDone || !may_move()) break;
    if (end == PassEnd::kMoved && rest_.held == 0 && move_.moved_little) break;
    // The planes that a short step has found may lead farther; a second one says that they do not.
    if (pass_.is_short && ++short_passes == kMostShortPasses) break;
    if (!has_budget(tick)) {
      move_.spent = move_.spent || end == PassEnd::kMoved;
      break;
    }
  }
  // With one pass in a tick its way is straight.
  // What goes all the way with the goal is not held by a low step.
  const bool follows = has_long_lists() && end == PassEnd::kMoved && pass_.whole && rest_.held == 0;
  // The list of near pairs has been outrun, or the passes have ended before a screened part was as
  // fast as it asks to be.
  const bool outrun = move_.list_cut && tick.moved;
  const bool was_short =
      was_bound && end == PassEnd::kMoved && tick.work.passes == parameters_.passes;
  if (end != PassEnd::kSpent && parameters_.passes > 1 && !follows) {
    if (climb(goal, tick)) {
      end = PassEnd::kMoved;
      tick.moved = true;
    }
  }
  if (outrun || was_short) move_.spent = true;
  return end;
}

/// The smallest known gap, a lower bound of the distance.
void Proxy::tell_gap(PassEnd end, ProxyTick& tick) noexcept {
  for (const ReachedPair& reached : pass_.reached) {
    const ProxyPair& pair = near_.pairs[reached.pair];
    const bool accepted = pair.gap_version == part_.version;
    Real gap_m = accepted ? pair.gap_m : reached.gap_q_m;
    if (!accepted && end != PassEnd::kMoved) gap_m = reached.gap_m;  // p has stayed
    // Its plane has passed, and there was no budget for another: p is free all the same.
    if (reached.unsure) gap_m = std::max(gap_m, Real{0});
    tick.gap_m = std::min(tick.gap_m, gap_m);
  }
  for (const std::uint32_t slot : beside()) {  // certified, where its gap was not looked at again
    tick.gap_m = std::min(tick.gap_m, std::max(seen(slot).gap_m, -parameters_.scale.tolerance_m));
  }
}

/// Notes if a tick with the same goal could find anything better; `chosen`: this one has chosen its
/// planes from the start.
void Proxy::end_rest(PassEnd end, bool chosen, const ProxyTick& tick) noexcept {
  rest_.still = !tick.moved && !pass_.inside && !move_.spent &&
                (end == PassEnd::kDone || rest_.held >= kLeastHeld);
  // Only with planes that this tick has chosen from the start, to the end; else the next one with
  // this goal does, or goes on with it.
  rest_.settled = rest_.still && chosen && (!pass_.keeps_active || rest_.held >= kMostChoices);
  // A part that is on its way, however long that takes, is not one that looks for its place.
  const bool gains = !may_move() || (tick.moved && move_.longest) ||
                     tick.end_potential_j < (1 - kOnItsWay) * tick.start_potential_j;
  rest_.slow = rest_.held == 0 ? 0
               : gains         ? rest_.slow - (rest_.slow > 0)
                               : std::min(rest_.slow + 1, kMostHeld);
  if (!rest_.settled) return;
  rest_.settled_tick[0] = tick;
  rest_.settled_tick[0].work = ProxyWork{};
}

ProxyTick Proxy::tick(const GripPose& goal, NearScratch& scratch) noexcept {
  scratch_.near = &scratch;
  move_.grants = 0;
  begin_lists();
  near_.waited = near_.waiting;
  near_.waiting = false;
  if (begin_rest(goal)) {
    settle_slip();
    return rest_.settled_tick[0];
  }
  const bool chosen = rest_.choose_from_start || sticks();
  ProxyTick tick = begin_tick(goal);
  const PassEnd end = make_passes(goal, tick);
  move_.behind_ticks = move_.spent ? move_.behind_ticks + 1 : 0;
  tick.behind_ticks = move_.behind_ticks;
  tick.spent = move_.spent;
  tick.recovering = pass_.recovering;
  rest_.choice_spent = !tick.moved && (rest_.choice_spent || (chosen && move_.spent));
  if (tick.residual_n > kResidual_n || rest_.choice_spent) tick.limited = true;
  tick.error = error_of(goal, part_.pose);
  tell_gap(end, tick);
  range_.pass_units = std::max(range_.pass_units / 2,
                               tick.work.units() - tick.work.list_visits / kListVisitsOfUnit);
  settle_slip();
  feel(tick);
  if (!pass_.inside && !near_.waiting && unlisted_m() > 0) out_.led_out = false;
  end_rest(end, chosen, tick);
  return tick;
}

}  // namespace haptic
