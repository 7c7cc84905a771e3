// SPDX-License-Identifier: Apache-2.0
#include "rt_core/tracking/goal_contact.hpp"

#include <algorithm>
#include <cmath>

namespace haptic {
namespace {

/// How much more than the stated motion a tick may bring before it is flagged: rounding of the
/// device's own pose.
constexpr Real kMotionMargin = 1.000001_r;

bool pair_has_hidden(const PairView& pair) noexcept {
  const auto counts = [&](NodeScope scope) {
    return live_counts(pair.marks, scope, pair.record, *pair.a.record, *pair.b.record);
  };
  return has_hidden(counts(NodeScope::kReachable), counts(NodeScope::kLive));
}

/// Length of the difference of two unit quaternions, sign-aligned: the chord of the turn between
/// them is at most twice that.
Real quaternion_step(const Quat& l, const Quat& r) noexcept {
  const Real minus = (l.coeffs() - r.coeffs()).squaredNorm();
  const Real plus = (l.coeffs() + r.coeffs()).squaredNorm();
  return std::sqrt(std::min(minus, plus));
}

}  // namespace

void SearchWork::add(const SearchWork& other) noexcept {
  pair_visits += other.pair_visits;
  support_pairs += other.support_pairs;
  feature_evaluations += other.feature_evaluations;
  edge_pairs += other.edge_pairs;
  near_nodes += other.near_nodes;
  stale_pairs += other.stale_pairs;
  flags |= other.flags;
}

void GoalContactStage::place(Arena& arena, const SceneView& scene, bool searches) noexcept {
  const SceneCapacity& c = scene.header().capacity;
  const std::uint32_t pairs = searches ? c.pair_count : 0;
  const std::uint32_t moving_pieces = scene.bodies()[0].piece_count;
  arena.enter(StatePart::kPairs);
  pairs_ = arena.take<PairState>(pairs);
  gates_ = arena.take<PairGate>(pairs);
  bodies_ = arena.take<BodyMotion>(scene.bodies().size());
  if (searches) {
    moving_lanes_ = arena.take<Real>(3 * std::size_t{c.moving_lanes});
    lanes_begin_ = arena.take<std::size_t>(moving_pieces);
    lanes_turned_at_ = arena.take<std::uint64_t>(moving_pieces);
  }
  NearScratch::Size size;
  arena.enter(StatePart::kBounds);
  size.fit(largest_counts(scene.pieces().first(moving_pieces)),
           largest_counts(scene.pieces().subspan(moving_pieces)));
  for (std::uint32_t i = 0; i < c.pair_count && searches; ++i) {
    const PairRecord record = scene.pair_record(i);
    FeatureBounds bounds;
    bounds.place(arena, scene.pieces()[record.piece_a], scene.pieces()[record.piece_b]);
    if (!pairs_.empty()) pairs_[i].bounds = bounds;
  }
  arena.enter(StatePart::kSearch);
  room_.scratch.place(arena, size);
  const std::size_t near_nodes = near_room(c, searches);
  arena.enter(StatePart::kContacts);
  room_.near = BoundedList<NearNode>(arena.take<NearNode>(near_nodes));
  room_.contact_nodes = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(near_nodes));
  candidates_ = BoundedList<Candidate>(arena.take<Candidate>(pairs));
  const bool is_at_goal = kSceneTraits.is_at_goal(scene.parameters().law);
  patches_ = BoundedList<ContactPatch>(arena.take<ContactPatch>(is_at_goal ? pairs : 0));
  points_ = BoundedList<Vec3>(arena.take<Vec3>(is_at_goal ? near_nodes : 0));
}

void GoalContactStage::read_scene(const SceneView& scene,
                                  std::span<const PairView> pairs) noexcept {
  const SceneParameters& p = scene.parameters();
  views_ = pairs;
  law_ = p.law;
  epsilon_m_ = static_cast<Real>(p.epsilon_m);
  exact_band_m_ = p.exact_band_m;
  max_visits_ = scene.header().capacity.max_pair_visits;
  if (p.motion_limits_given != 0) {
    max_step_m_ = static_cast<Real>(p.max_linear_speed_m_per_s / p.rate_hz) * kMotionMargin;
    max_turn_rad_ = static_cast<Real>(p.max_angular_speed_rad_per_s / p.rate_hz) * kMotionMargin;
  }
  std::size_t lanes = 0;
  for (std::uint32_t i = 0; i < lanes_begin_.size(); ++i) {
    lanes_begin_[i] = lanes;
    lanes += 3 * std::size_t{scene.piece(i).lane_count};
  }
  for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
    const double(&at)[3] = scene.bodies()[i].reference_m;
    bodies_[i].reference_w = {static_cast<Real>(at[0]), static_cast<Real>(at[1]),
                              static_cast<Real>(at[2])};
  }
  for (std::uint32_t i = 0; i < pairs_.size(); ++i) {
    pairs_[i].has_hidden = pair_has_hidden(pairs[i]);
    has_seams_ = has_seams_ || pairs_[i].has_hidden;
    gates_[i].reach_a_m = pairs[i].a.record->reach_m;
    gates_[i].reach_b_m = pairs[i].b.record->reach_m;
    gates_[i].body_b = pairs[i].b.record->body;
  }
}

void GoalContactStage::reset() noexcept {
  for (std::uint32_t i = 0; i < pairs_.size(); ++i) {
    PairState& pair = pairs_[i];
    pair.bounds.reset(views_[i].marks);
    pair.verdict_memory = VerdictMemory{};
    pair.visited_at = 0;
    pair.exact = false;
    pair.bears = true;
    pair.situation = ContactSituation::kNone;
  }
  for (PairGate& gate : gates_) gate.plane = GatePlane{};
  for (BodyMotion& body : bodies_) body.swept_m = 0;
  for (std::uint64_t& turned : lanes_turned_at_) turned = 0;
  motion_ = MotionSum{};
  has_last_ = false;
  tick_ = searched_at_ = 0;
}

/// Odometers, each step rounded up; a tick at rest leaves them alone.
std::uint32_t GoalContactStage::advance(const GripPose& goal) noexcept {
  tick_ += 1;
  room_.near.clear();
  room_.contact_nodes.clear();
  patches_.clear();
  points_.clear();
  const GripPose last = last_;
  last_ = goal;
  if (!has_last_) {
    has_last_ = true;
    return 0;
  }
  const Real step = std::sqrt((goal.x0_w - last.x0_w).squaredNorm());
  const Real turn = 2 * quaternion_step(goal.q_wa, last.q_wa);
  const bool exceeded =
      (max_step_m_ > 0 && step > max_step_m_) || (max_turn_rad_ > 0 && turn > max_turn_rad_);
  const std::uint32_t flags = exceeded ? std::uint32_t{kFlagMotionExceeded} : 0u;
  if (step == 0 && turn == 0) return flags;
  constexpr double kUp = 1 + 64 * static_cast<double>(kRealEpsilon);
  motion_.path_m = (motion_.path_m + static_cast<double>(step) * kUp) * (1 + 0x1p-52);
  motion_.turn_rad = (motion_.turn_rad + static_cast<double>(turn) * kUp) * (1 + 0x1p-52);
  for (BodyMotion& body : bodies_) {
    const Real distance = std::sqrt((last.x0_w - body.reference_w).squaredNorm()) + step;
    body.swept_m = (body.swept_m + static_cast<double>(turn * distance) * kUp) * (1 + 0x1p-52);
  }
  return flags;
}

Odometer GoalContactStage::odometer(const PairGate& gate) const noexcept {
  const double swept = bodies_[gate.body_b].swept_m;
  return {motion_.path_m + (swept + motion_.turn_rad * gate.reach_b_m),
          motion_.path_m + motion_.turn_rad * gate.reach_a_m};
}

/// Looks at every pair that no plane proves to be far, nearest first while the budget lasts; the
/// others get a verdict.
ContactSet GoalContactStage::search(const GripPose& goal) noexcept {
  searched_at_ = tick_;
  ContactSet set;
  set.searched = true;
  Nearest nearest;
  candidates_.clear();
  const auto count = static_cast<std::uint32_t>(gates_.size());
  for (std::uint32_t i = 0; i < count; ++i) {
    const Gated gated = pass_gate(i, goal);
    set.work.support_pairs += gated.renewed ? 1 : 0;
    if (gated.is_far) {
      set.work.flags |= kFlagFarBand;
      nearest.offer(i, static_cast<Real>(gated.gap_m));
    } else {
      static_cast<void>(candidates_.push({gated.gap_m, i}));
    }
  }
  std::uint32_t visits = candidates_.size();
  if (visits > max_visits_) {
    const auto nearer = [](const Candidate& l, const Candidate& r) {
      return l.gap_m < r.gap_m || (l.gap_m == r.gap_m && l.pair < r.pair);
    };
    // A heap sort: no recursion, n log n.
    std::make_heap(candidates_.begin(), candidates_.end(), nearer);
    std::sort_heap(candidates_.begin(), candidates_.end(), nearer);
    visits = max_visits_;
    set.work.flags |= kFlagBudgetUsedUp;
  }
  for (std::uint32_t k = 0; k < candidates_.size(); ++k) {
    const Candidate& candidate = candidates_[k];
    PairState& pair = pairs_[candidate.pair];
    if (k < visits) {
      set.work.add(visit(candidate.pair, goal));
    } else {
      set.work.add(hold(candidate, goal));
    }
    nearest.offer(candidate.pair, pair.d_near_m);
  }
  set.d_near_m = nearest.d_near_m;
  set.nearest_pair = nearest.pair;
  if (const PairState* felt = felt_pair(nearest)) {
    set.situation = felt->situation;
    set.near_count = felt->near_count;
  }
  set.near = room_.near.view();
  set.patches = patches_.view();
  set.points = points_.view();
  return set;
}

/// Whose contact is felt: the nearest pair's; where all of its contacts lie past the ends of their
/// features, that of the deepest pair that has one. Null: none was looked at.
const GoalContactStage::PairState* GoalContactStage::felt_pair(
    const Nearest& nearest) const noexcept {
  const PairState& first = pairs_[nearest.pair];
  const PairState* felt = first.visited_at == tick_ ? &first : nullptr;
  if (nearest.d_near_m > 0 || (felt && felt->situation != ContactSituation::kNone)) return felt;
  const PairState* deepest = nullptr;
  for (const Candidate& candidate : candidates_) {
    const PairState& pair = pairs_[candidate.pair];
    if (pair.situation == ContactSituation::kNone) continue;
    if (deepest == nullptr || pair.d_near_m < deepest->d_near_m) deepest = &pair;
  }
  return deepest != nullptr ? deepest : felt;
}

/// Renews the gate's plane where the last one tells nothing any more.
GoalContactStage::Gated GoalContactStage::pass_gate(std::uint32_t index,
                                                    const GripPose& goal) noexcept {
  PairGate& gate = gates_[index];
  const Odometer now = odometer(gate);
  Gated result;
  result.gap_m = gate.plane.gap_m(now);
  if (!is_far(result.gap_m, gate.plane.face, exact_band_m_)) {
    const Vec3 y_w = goal.x0_w - bodies_[gate.body_b].reference_w;
    if (!gate.plane.known) {
      gate.plane = sphere_gate(views_[index], goal.r_wa, y_w, now);
      result.gap_m = gate.plane.gap_m(now);
    } else if (renew_gate(views_[index], goal.r_wa, y_w, now, exact_band_m_, gate.plane)) {
      result.renewed = true;
      result.gap_m = gate.plane.gap_m(now);
    }
  }
  result.is_far = haptic::is_far(result.gap_m, gate.plane.face, exact_band_m_);
  return result;
}

/// The pair's pose; turns the vertices of its piece of A if no pair before it has.
PairPose GoalContactStage::pose_of(std::uint32_t pair, const GripPose& goal) noexcept {
  const PairView& view = views_[pair];
  const Vec3 y_w = goal.x0_w - bodies_[gates_[pair].body_b].reference_w;
  const std::uint32_t piece = view.record.piece_a;
  Real* const lanes = moving_lanes_.data() + lanes_begin_[piece];
  if (lanes_turned_at_[piece] != tick_) {
    turn_vertices(view.a, goal.r_wa, lanes);
    lanes_turned_at_[piece] = tick_;
  }
  return make_pair_pose(view, lanes, goal.r_wa, y_w);
}

/// Near set, verdict and contact of a pair.
SearchWork GoalContactStage::visit(std::uint32_t index, const GripPose& goal) noexcept {
  PairState& pair = pairs_[index];
  const PairPose pose = pose_of(index, goal);
  const Odometer now = odometer(gates_[index]);
  pair.bounds.advance(now, pose.size_m);
  const bool first = pair.visited_at == 0;
  pair.near_begin = room_.near.size();
  const NearResult found = find_near_set(pose, epsilon_m_, pair.bounds, room_.scratch, room_.near);
  pair.verdict = pair_verdict(pose, found, pair.verdict_memory);
  pair.exact = (found.flags & kNearEdgePairsCut) == 0;
  pair.d_near_m = found.d_near_m;
  if (pair.verdict.verdict == Verdict::kSeparated) {
    pair.d_near_m = std::max(pair.d_near_m, pair.verdict.separation_bound_m);
  }
  pair.best = found.best;
  pair.bears = found.d_near_m != kNoDepth;  // marks that fit the envelope leave some node
  pair.visited_at = tick_;
  gates_[index].plane = gate_plane(pose, found, now);

  SearchWork work;
  work.pair_visits = 1;
  work.feature_evaluations = found.feature_evaluations;
  work.edge_pairs = found.edge_pairs;
  work.support_pairs = found.support_pairs + pair.verdict.support_pairs;
  if ((found.flags & kNearSetCut) != 0) work.flags |= kFlagNearSetCut;
  if (pair.has_hidden && pair.d_near_m <= 0) {
    const LiveContact live = live_contact(pair, pose, found);
    if (live.searched) {
      work.feature_evaluations += live.found.feature_evaluations;
      work.edge_pairs += live.found.edge_pairs;
      work.support_pairs += live.found.support_pairs;
      if ((live.found.flags & kNearSetCut) != 0) work.flags |= kFlagNearSetCut;
      pair.exact = pair.exact && (live.found.flags & kNearEdgePairsCut) == 0;
      pair.bears = live.found.d_near_m != kNoDepth;
      if (pair.bears) {
        pair.d_near_m = live.found.d_near_m;
        pair.best = live.found.best;
      }
    }
  }
  pair.near_count = room_.near.size() - pair.near_begin;
  work.near_nodes = pair.near_count;
  if ((found.flags & kNearAllStale) != 0) {
    work.stale_pairs = first ? 0 : 1;
    work.flags |= first ? kFlagFirstTick : kFlagRelocalised;
  }
  if (!pair.exact) work.flags |= kFlagInexact;
  if (pair.verdict.verdict == Verdict::kTouching) work.flags |= kFlagVerdictTouching;
  if (pair.verdict.verdict == Verdict::kUndecided) work.flags |= kFlagVerdictUndecided;
  work.flags |= touch(index, pose);
  return work;
}

/// Of a colliding pair: its contact over the nodes that carry force. It is that of the search
/// before where the nearest C-face carries force itself; else the near set is searched again.
GoalContactStage::LiveContact GoalContactStage::live_contact(PairState& pair, const PairPose& pose,
                                                             const NearResult& found) noexcept {
  const PairView& view = *pose.pair;
  const bool bears = found.attained && view.marks.node(NodeScope::kLive, found.best.node);
  LiveContact live;
  if (bears) return live;
  live.searched = true;
  room_.near.truncate(pair.near_begin);
  live.found =
      find_near_set(pose, epsilon_m_, pair.bounds, room_.scratch, room_.near, NodeScope::kLive);
  return live;
}

/// No budget is left for this pair: it has a verdict, but no search. Apart, its gap along some
/// plane is reported; colliding, the gap along the plane that was the nearest when it was visited
/// last, which is taken to be the nearest still.
SearchWork GoalContactStage::hold(const Candidate& candidate, const GripPose& goal) noexcept {
  PairState& pair = pairs_[candidate.pair];
  const PairPose pose = pose_of(candidate.pair, goal);
  const Odometer now = odometer(gates_[candidate.pair]);
  GatePlane& gate = gates_[candidate.pair].plane;
  SearchWork work;
  if (renew_gate(*pose.pair, pose.r_wa, pose.y_w, now, 0, gate)) work.support_pairs += 1;
  const double gap_m = std::max(gate.gap_m(now), candidate.gap_m);
  Real depth_m = static_cast<Real>(gap_m);  // where it collides, at least
  if (gap_m > 0) {
    pair.verdict = VerdictResult{};
    pair.verdict.verdict = Verdict::kSeparated;
    pair.verdict.normal_w = gate.of_a ? Vec3(pose.r_wa * gate.normal) : gate.normal;
    pair.verdict.separation_bound_m = depth_m;
  } else {
    NearResult plane;
    pair.verdict = verdict_alone(pose, pair.verdict_memory, plane);
    work.support_pairs += pair.verdict.support_pairs;
    work.feature_evaluations += plane.feature_evaluations;
    depth_m = std::max(depth_m, plane.d_near_m);
    if (pair.verdict.verdict == Verdict::kSeparated) gate = gate_plane(pose, plane, now);
  }
  pair.exact = false;
  pair.near_begin = room_.near.size();
  pair.near_count = 0;
  if (pair.verdict.verdict == Verdict::kSeparated) {
    pair.d_near_m = pair.verdict.separation_bound_m;
  } else {
    pair.d_near_m = held_depth(pair, pose, depth_m, work);
    work.flags |= kFlagInexact;
    if (pair.verdict.verdict == Verdict::kTouching) work.flags |= kFlagVerdictTouching;
    if (pair.verdict.verdict == Verdict::kUndecided) work.flags |= kFlagVerdictUndecided;
  }
  work.flags |= touch(candidate.pair, pose);
  return work;
}

/// Depth of a pair that collides and is not searched: the gap along its last C-face, which stands
/// in the near set, or `at_least_m` if that is more; never positive.
Real GoalContactStage::held_depth(PairState& pair, const PairPose& pose, Real at_least_m,
                                  SearchWork& work) noexcept {
  if (pair.visited_at == 0) {
    pair.bears = false;  // no C-face is known
    return std::min(at_least_m, Real{0});
  }
  NearNode& best = pair.best;
  if (const NodePlane plane = node_plane(pose, best.type, best.i, best.j); plane.defined) {
    best.normal_w = plane.normal_w;
    best.f_m = plane.f_m;
  }
  pair.verdict.normal_w = best.normal_w;
  const SupportPair support = support_pair(pose, best.normal_w, pair.verdict_memory.portal[0]);
  work.support_pairs += 1;
  at_least_m = std::max(at_least_m, gap_along(pose, best.normal_w, support));
  pair.near_count = pair.bears && room_.near.push(best) ? 1 : 0;
  return std::min(at_least_m, Real{0});
}

/// Contact region of a pair whose near set stands in the list; flags.
std::uint32_t GoalContactStage::touch(std::uint32_t index, const PairPose& pose) noexcept {
  PairState& pair = pairs_[index];
  pair.contact_begin = room_.contact_nodes.size();
  pair.contact_count = 0;
  if (pair.d_near_m > 0 || !pair.bears) {
    pair.situation = ContactSituation::kNone;
    return 0;
  }
  const std::span<NearNode> nodes(room_.near.begin() + pair.near_begin, pair.near_count);
  locate_contacts(pose, nodes, !pair.has_hidden);
  bool several_planes = false;
  ContactPatch patch = make_contact_patch(pose, nodes, pair.d_near_m, epsilon_m_,
                                          room_.contact_nodes, several_planes);
  patch.near_begin = pair.near_begin;
  patch.near_count = pair.near_count;
  const bool is_at_goal = kSceneTraits.is_at_goal(law_);
  // Where pieces meet, all nodes may lie past the ends of their features: another piece touches.
  const bool elsewhere =
      pair.has_hidden && std::none_of(nodes.begin(), nodes.end(), [&](const NearNode& n) {
        return n.outside_m <= patch.merge_distance_m;
      });
  if (elsewhere) {
    room_.contact_nodes.truncate(pair.contact_begin);
    pair.situation = ContactSituation::kNone;
    if (is_at_goal) return 0;
  } else {
    pair.contact_count = room_.contact_nodes.size() - pair.contact_begin;
    pair.situation = settled_situation(nodes, pair.d_near_m, epsilon_m_, pair.situation);
  }
  if (is_at_goal) {
    collect_points(nodes, epsilon_m_, points_, patch);
    patch.situation = several_planes ? ContactSituation::kSeveralPlanes
                                     : situation_of(nodes, pair.d_near_m, epsilon_m_, 1);
  }
  if (kMergesPatches) static_cast<void>(patches_.push(patch));
  return is_at_goal && several_planes ? std::uint32_t{kFlagSeveralPlanes} : 0u;
}

PairReport GoalContactStage::report(std::uint32_t index) const noexcept {
  const PairState& pair = pairs_[index];
  PairReport report;
  if (tick_ == 0 || searched_at_ != tick_) return report;
  report.searched = true;
  report.visited = pair.visited_at == tick_;
  const PairGate& gate = gates_[index];
  const double gap = gate.plane.gap_m(odometer(gate));
  if (!report.visited && is_far(gap, gate.plane.face, exact_band_m_)) {
    report.verdict = Verdict::kSeparated;
    report.separation_bound_m = static_cast<Real>(gap);
    report.d_near_m = static_cast<Real>(gap);
    report.normal_w = gate.plane.of_a ? Vec3(last_.r_wa * gate.plane.normal) : gate.plane.normal;
    return report;
  }
  report.verdict = pair.verdict.verdict;
  report.normal_w = pair.verdict.normal_w;
  report.separation_bound_m = pair.verdict.separation_bound_m;
  report.thickness_m = pair.verdict.thickness_m;
  report.portal = pair.verdict_memory.portal;
  report.d_near_m = pair.d_near_m;
  report.situation = pair.situation;
  if (!report.visited) return report;  // held for want of budget
  report.exact = pair.exact;
  report.best_node = pair.best.node;
  report.near = room_.near.view().subspan(pair.near_begin, pair.near_count);
  report.contact_nodes = room_.contact_nodes.view().subspan(pair.contact_begin, pair.contact_count);
  return report;
}

void GoalContactStage::describe(std::uint32_t index, const HullScratch& hull,
                                ContactGeometry& out) const noexcept {
  const PairState& pair = pairs_[index];
  if (tick_ == 0 || searched_at_ != tick_ || pair.visited_at == 0) return;
  const PairGate& gate = gates_[index];
  const bool looked_at = pair.visited_at == tick_ ||
                         !is_far(gate.plane.gap_m(odometer(gate)), gate.plane.face, exact_band_m_);
  if (!looked_at || pair.contact_count == 0) return;
  ContactNodes contact;
  contact.near = room_.near.view().subspan(pair.near_begin, pair.near_count);
  contact.nodes = room_.contact_nodes.view().subspan(pair.contact_begin, pair.contact_count);
  contact.d_near_m = pair.d_near_m;
  contact.situation = pair.situation;
  contact.epsilon_m = epsilon_m_;
  describe_contact(views_[index], contact, last_.x0_w, hull, out);
}

}  // namespace haptic
