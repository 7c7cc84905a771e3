// SPDX-License-Identifier: Apache-2.0
// Which pairs a tick looks at, and what it finds out about each.
#include <algorithm>

#include "rt_core/core_state.hpp"

namespace haptic {

/// The contact at the goal pose: D_near, verdicts, near sets and patches of all pairs.
void HapticCore::State::search_goal(const GripPose& grip, StepResult& result) noexcept {
  searched_at = tick;
  result.has_goal_contact = true;
  result.d_near_m = std::numeric_limits<Real>::max();
  pass_gate(grip, result);
  spend_budget(grip, result);
}

/// Laws that measure at the goal: what is felt is the contact of the nearest pair there.
void HapticCore::State::report_contact(StepResult& result) const noexcept {
  const PairState& nearest = pairs[result.nearest_pair];
  if (nearest.visited_at != tick) return;
  result.situation = nearest.situation;
  result.near_count = nearest.near_count;
}

/// Sorts the pairs into those that a plane proves to be far and the candidates for a visit.
void HapticCore::State::pass_gate(const GripPose& grip, StepResult& result) noexcept {
  candidates.clear();
  const auto count = kSceneTraits.several_pairs ? static_cast<std::uint32_t>(gates.size()) : 1u;
  for (std::uint32_t i = 0; i < count; ++i) {
    PairGateState& gate = gates[i];
    const Odometer now = odometer(gate);
    double gap = gate.plane.gap_m(now);
    if (!is_far(gap, gate.plane.face, exact_band_m)) {
      const Vec3 y_w = grip.x0_w - bodies[gate.body_b].reference_w;
      if (pairs[i].visited_at == 0) {
        gate.plane = sphere_gate(pairs[i].view, grip.r_wa, y_w, now);
        gap = gate.plane.gap_m(now);
      } else if (renew_gate(pairs[i].view, grip.r_wa, y_w, now, exact_band_m, gate.plane)) {
        result.counters.support_pairs += 1;
        gap = gate.plane.gap_m(now);
      }
    }
    if (is_far(gap, gate.plane.face, exact_band_m)) {
      result.flags |= kFlagFarBand;
      report_nearest(i, static_cast<Real>(gap), result);
    } else {
      static_cast<void>(candidates.push({gap, i}));
    }
  }
}

/// Visits the candidates, nearest first while the budget lasts; the others keep their last plane.
void HapticCore::State::spend_budget(const GripPose& grip, StepResult& result) noexcept {
  std::uint32_t visits = candidates.size();
  if (kSceneTraits.visit_budget && visits > max_visits) {
    const auto nearer = [](const Candidate& l, const Candidate& r) {
      return l.gap_m < r.gap_m || (l.gap_m == r.gap_m && l.pair < r.pair);
    };
    // A heap sort: no recursion, n log n.
    std::make_heap(candidates.begin(), candidates.end(), nearer);
    std::sort_heap(candidates.begin(), candidates.end(), nearer);
    visits = max_visits;
    result.flags |= kFlagBudgetUsedUp;
  }
  for (std::uint32_t k = 0; k < candidates.size(); ++k) {
    if (!kSceneTraits.visit_budget || k < visits) {
      visit(candidates[k].pair, grip, result);
    } else {
      hold(candidates[k], grip, result);
    }
  }
}

/// The pair's pose; turns the vertices of its piece of A if no pair before it has.
PairPose HapticCore::State::pose_of(std::uint32_t pair, const GripPose& grip) noexcept {
  const PairView& view = pairs[pair].view;
  const Vec3 y_w = grip.x0_w - bodies[gates[pair].body_b].reference_w;
  if (is_fixed()) return make_pair_pose(view, view.a.lanes, grip.r_wa, y_w);
  const std::uint32_t piece = view.record->piece_a;
  Real* const lanes = moving_lanes.data() + lanes_begin[piece];
  if (lanes_turned_at[piece] != tick) {
    turn_vertices(view.a, grip.r_wa, lanes);
    lanes_turned_at[piece] = tick;
  }
  return make_pair_pose(view, lanes, grip.r_wa, y_w);
}

void HapticCore::State::visit(std::uint32_t index, const GripPose& grip,
                              StepResult& result) noexcept {
  PairState& pair = pairs[index];
  const PairPose pose = pose_of(index, grip);
  const Odometer now = odometer(gates[index]);
  if (!is_fixed()) pair.bounds.advance(now, pose.size_m);
  const bool first = pair.visited_at == 0;
  pair.near_begin = near.size();
  const NearResult found = find_near_set(pose, epsilon_m, pair.bounds, scratch, near);
  pair.verdict = pair_verdict(pose, found, pair.verdict_memory);
  pair.exact = (found.flags & kNearEdgePairsCut) == 0;
  pair.d_near_m = found.d_near_m;
  if (pair.verdict.verdict == Verdict::kSeparated) {
    pair.d_near_m = std::max(pair.d_near_m, pair.verdict.separation_bound_m);
  }
  pair.best = found.best;
  pair.bears = found.d_near_m != kNoDepth;  // marks that fit the envelope leave some node
  pair.visited_at = tick;
  gates[index].plane = gate_plane(pose, found, now);
  if (pair.has_hidden && pair.d_near_m <= 0) measure_live(pair, pose, found, result);
  pair.near_count = near.size() - pair.near_begin;

  StepCounters& counters = result.counters;
  counters.pair_visits += 1;
  counters.feature_evaluations += found.feature_evaluations;
  counters.edge_pairs += found.edge_pairs;
  counters.support_pairs += found.support_pairs + pair.verdict.support_pairs;
  counters.near_nodes += pair.near_count;
  if (is_fixed() && first) result.flags |= kFlagFirstTick;
  if ((found.flags & kNearAllStale) != 0) {
    counters.stale_pairs += first ? 0 : 1;
    result.flags |= first ? kFlagFirstTick : kFlagRelocalised;
  }
  if ((found.flags & kNearSetCut) != 0) result.flags |= kFlagNearSetCut;
  if (!pair.exact) result.flags |= kFlagInexact;
  if (pair.verdict.verdict == Verdict::kTouching) result.flags |= kFlagVerdictTouching;
  if (pair.verdict.verdict == Verdict::kUndecided) result.flags |= kFlagVerdictUndecided;
  report_nearest(index, pair.d_near_m, result);
  touch(pair, pose, result);
}

/// Depth, nearest C-face and near set of a colliding pair over the nodes that carry force. They are
/// those of the search before where its nearest C-face carries force itself.
void HapticCore::State::measure_live(PairState& pair, const PairPose& pose, const NearResult& found,
                                     StepResult& result) noexcept {
  const bool bears = found.attained &&
                     (is_fixed() ? has_force(pair.view.planes[found.support.a], PlaneForce::kBears)
                                 : pair.view.marks.node(NodeScope::kLive, found.best.node));
  if (bears) return;
  near.truncate(pair.near_begin);
  const NearResult live =
      find_near_set(pose, epsilon_m, pair.bounds, scratch, near, NodeScope::kLive);
  StepCounters& counters = result.counters;
  counters.feature_evaluations += live.feature_evaluations;
  counters.edge_pairs += live.edge_pairs;
  counters.support_pairs += live.support_pairs;
  if ((live.flags & kNearSetCut) != 0) result.flags |= kFlagNearSetCut;
  pair.exact = pair.exact && (live.flags & kNearEdgePairsCut) == 0;
  pair.bears = live.d_near_m != kNoDepth;
  if (!pair.bears) return;
  pair.d_near_m = live.d_near_m;
  pair.best = live.best;
}

/// No budget is left for this pair: its last nearest C-face is taken to be the nearest still.
void HapticCore::State::hold(const Candidate& candidate, const GripPose& grip,
                             StepResult& result) noexcept {
  const std::uint32_t index = candidate.pair;
  PairState& pair = pairs[index];
  pair.exact = false;
  if (pair.visited_at == 0) {
    report_nearest(index, static_cast<Real>(candidate.gap_m), result);
    return;
  }
  const PairPose pose = pose_of(index, grip);
  const NodePlane plane = node_plane(pose, pair.best.type, pair.best.i, pair.best.j);
  if (plane.defined) {
    pair.best.normal_w = plane.normal_w;
    pair.best.f_m = plane.f_m;
    pair.d_near_m = plane.f_m;
  }
  pair.near_begin = near.size();
  pair.near_count = pair.bears && near.push(pair.best) ? 1 : 0;
  report_nearest(index, pair.d_near_m, result);
  touch(pair, pose, result);
}

/// Contact region of a pair whose near set stands in the list.
void HapticCore::State::touch(PairState& pair, const PairPose& pose, StepResult& result) noexcept {
  pair.contact_begin = contact_nodes.size();
  pair.contact_count = 0;
  if (pair.d_near_m > 0 || !pair.bears) {
    pair.situation = ContactSituation::kNone;
    return;
  }
  const std::span<NearNode> nodes(near.begin() + pair.near_begin, pair.near_count);
  locate_contacts(pose, nodes, !pair.has_hidden);
  bool several_planes = false;
  ContactPatch patch =
      make_contact_patch(pose, nodes, pair.d_near_m, epsilon_m, contact_nodes, several_planes);
  patch.near_begin = pair.near_begin;
  patch.near_count = pair.near_count;
  // Where pieces meet, all nodes may lie past the ends of their features: another piece touches.
  const bool elsewhere =
      pair.has_hidden && std::none_of(nodes.begin(), nodes.end(), [&](const NearNode& n) {
        return n.outside_m <= patch.merge_distance_m;
      });
  if (elsewhere) {
    contact_nodes.truncate(pair.contact_begin);
    pair.situation = ContactSituation::kNone;
    if (has_law(LawId::kPaper)) return;
  } else {
    pair.contact_count = contact_nodes.size() - pair.contact_begin;
    pair.situation = settled_situation(nodes, pair.d_near_m, epsilon_m, pair.situation);
  }
  if (has_law(LawId::kPaper)) {
    if (several_planes) result.flags |= kFlagSeveralPlanes;
    collect_points(nodes, epsilon_m, points, patch);
    patch.situation = several_planes ? ContactSituation::kSeveralPlanes
                                     : situation_of(nodes, pair.d_near_m, epsilon_m, 1);
  }
  if (kMergesPatches) static_cast<void>(patches.push(patch));
}

}  // namespace haptic
