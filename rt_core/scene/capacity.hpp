// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Capacities and work bounds of a scene as functions of its counts: the compiler writes them,
/// SceneView recomputes and compares them, the core sizes its memory and stops its loops by them.
/// One place for each formula.

#include <algorithm>
#include <cstdint>
#include <span>

#include "rt_core/scene/formed_pairs.hpp"
#include "rt_core/scene/node_marks.hpp"
#include "rt_core/scene/proxy_limits.hpp"
#include "rt_core/scene/scene_format.hpp"
#include "rt_core/scene/screen_size.hpp"

namespace haptic {

/// Cap on support pairs of one attempt of the pair verdict; a verdict has two attempts (warm,
/// cold).
inline constexpr std::uint32_t kMaxSupportPairsPerAttempt = 64;
inline constexpr std::uint32_t kMaxSupportPairsPerVerdict = 2 * kMaxSupportPairsPerAttempt;

/// Work of one pair in one tick, at most. With all keys stale (the first tick, or a jump) every
/// reachable face and edge is evaluated once; where some node only separates, a second search may
/// go over the live ones; an edge pair or a near node asks for at most one support pair
/// of its own; the gate asks for two.
struct PairBounds {
  std::uint64_t feature_evaluations, edge_pairs, support_pairs, near_nodes;
};
constexpr PairBounds pair_bounds(const PieceRecord& a, const PieceRecord& b, const PairRecord& pair,
                                 const NodeMarks& marks) noexcept {
  const LiveCounts reachable = live_counts(marks, NodeScope::kReachable, pair, a, b);
  const LiveCounts live = live_counts(marks, NodeScope::kLive, pair, a, b);
  PairBounds bounds{};
  bounds.feature_evaluations = reachable.features;
  bounds.edge_pairs = pair.edge_pair_capacity;
  if (has_hidden(reachable, live)) {
    bounds.feature_evaluations += live.features;
    bounds.edge_pairs += edge_pair_capacity(live.edge_pairs);
  }
  bounds.near_nodes = pair.near_capacity;
  bounds.support_pairs = kMaxSupportPairsPerVerdict + bounds.edge_pairs;
  return bounds;
}

/// Support pairs of a pair that is not visited for want of budget: a verdict, and the gap along its
/// last plane.
inline constexpr std::uint32_t kHeldSupportPairs = kMaxSupportPairsPerVerdict + 1;

/// Support pairs that the gate asks for, of a pair in one tick.
inline constexpr std::uint32_t kGateSupportPairs = 2;

/// Pairs that a tick may visit where the scene does not say.
inline constexpr std::uint32_t kDefaultPairVisits = 64;

/// What the proxy may begin of one pair, in its units, at most: once when the units are spent.
struct PairWork {
  std::uint64_t set = 0;     ///< a valid set, and the gaps along its planes
  std::uint64_t search = 0;  ///< a plane where none is known: faces, then every basic contact
};
constexpr PairWork pair_work(const PieceRecord& a, const PieceRecord& b, const PairRecord& pair,
                             const LiveCounts& reachable) noexcept {
  const std::uint64_t faces = plane_count(b) + (a.face_count <= kFewFaces ? plane_count(a) : 0);
  const std::uint64_t edge_pairs = std::uint64_t{a.edge_count} * b.edge_count;
  const std::uint64_t scanned = std::min<std::uint64_t>(edge_pairs, kMostScannedPairs);
  const std::uint64_t scan = plane_count(a) + plane_count(b) + (a.edge_count + b.edge_count) / 16 +
                             scanned / kEdgePairsOfUnit +
                             std::min<std::uint64_t>(scanned, kMaxValidVisits) + 2;
  const bool scans = std::max(a.face_count, b.face_count) <= kMostScannedFaces &&
                     std::max(a.edge_count, b.edge_count) <= kMostScannedEdges &&
                     edge_pairs <= kMostScannedPairs;
  const std::uint64_t nodes =
      scans ? scan : std::max<std::uint64_t>(scan, kMaxValidVisits);  // else it may have to walk
  return {2 * faces + nodes + std::min<std::uint64_t>(nodes, kMaxValidPlanes),
          faces + reachable.features + pair.edge_pair_capacity / kEdgePairsOfUnit +
              std::min<std::uint64_t>(edge_pairs, kMaxNearestSupports)};
}

/// Nodes of two trees over pieces that lists of near pairs look at in one tick. `overflows`: there
/// may be more near pairs than slots, whose gaps are then asked along faces, which counts as
/// visits.
constexpr std::uint64_t list_visits(std::uint64_t pieces_a, std::uint64_t pieces_b,
                                    bool overflows) noexcept {
  if (overflows) return kListVisitsOfTick;
  return std::min<std::uint64_t>((2 * pieces_a - 1) * (2 * pieces_b - 1), kListVisitsOfTick);
}
/// What the last pair of such a list may add to them; `search`: PairWork::search of any pair.
constexpr std::uint64_t last_visits(std::uint64_t search, bool overflows) noexcept {
  constexpr std::uint64_t kOthers = kJoinVisits + kMostEdgeLines + 2 * kListVisitsOfUnit;
  return overflows ? (kListVisitsOfUnit + 1) * (search + 1) + kOthers : 0;
}

/// The same of any scene, or as many visits as the screen of one of facets alone may begin; `many`:
/// there are more pairs than slots.
constexpr std::uint64_t begun_visits(std::span<const PieceRecord> pieces, std::uint32_t pieces_a,
                                     bool many) noexcept {
  if (is_screened(pieces, pieces_a)) {
    return kListVisitsOfUnit * screen_size(pieces, pieces_a).begun_units();
  }
  return list_visits(pieces_a, pieces.size() - pieces_a, many);
}

/// Units that it takes to look at every near pair once: a gap, and of those that take turns a view.
constexpr std::uint64_t near_looks(std::uint32_t slots, std::uint32_t asked) noexcept {
  return (near_seats(slots, asked).take_turns ? 2 : 1) * std::uint64_t{slots};
}

/// Units that a tick may spend beyond its budget: it begins one thing of each kind, at most, when
/// the budget is spent or nearly so. `largest`: over all pairs; `facets`: of any body; `looks`:
/// what it takes to look at every near pair once.
constexpr std::uint64_t begun_units(const PairWork& largest, std::uint64_t looks,
                                    std::uint64_t visits, bool friction, bool facets) noexcept {
  constexpr std::uint64_t kProgram = kProgramUnits + kQpStepUnits * kMaxQpIterations;
  constexpr std::uint64_t kRegions =
      kMaxImposedPlanes + kGrantedSteps + 2 * kMaxFeltPlanes + kMaxTouchingLooks;
  // Of facets: the directions of imposed planes tried for one pair at both ends of a step, and the
  // regions of the pairs that are looked at twice for one that meets, at both ends.
  constexpr std::uint64_t kShared = 2 * kMaxSharedDirections;
  constexpr std::uint64_t kMeeting = 4 * kMaxMeetingLooks * (1 + kRegionUnits);
  const std::uint64_t programs = 1 + (friction ? kGrantedConePrograms + kGrantedShiftPrograms : 0);
  constexpr std::uint64_t kBalances = std::uint64_t{kMaxBalances} * kBalanceUnits;
  // Near pairs are measured at p_ and at the end of a step, and where a step goes farther once
  // more; contact regions are those of the planes imposed and felt.
  return visits / kListVisitsOfUnit + 3 * looks + largest.set + largest.search +
         programs * kProgram + (friction ? kBalances : 0) + kRegions * (1 + kRegionUnits) +
         kMaxImposedPlanes + (facets ? kShared + kMeeting : 0);
}

/// The proxy's quadratic programs in one tick, at most. A pass solves one per round,
/// kMaxBoundPrograms more, and twice one per correction, whose rows are one for each pair; with
/// friction kMaxConePrograms and kMaxShiftPrograms more, and one for each end of a settling.
/// `friction`: of any body.
struct ProgramBounds {
  std::uint32_t rounds, rows, iterations, programs, steps;
};
constexpr ProgramBounds program_bounds(std::uint64_t pairs, std::uint32_t passes,
                                       bool friction) noexcept {
  if (passes == 0) return {};
  constexpr std::uint32_t kRounds = kProxyRounds + kProxyRetries * kProxyRetryRounds;
  const auto corrected =
      static_cast<std::uint32_t>(std::min<std::uint64_t>(pairs, kMaxFrictionRows));
  const std::uint32_t cones =
      friction ? kMaxConePrograms + kMaxShiftPrograms + kRounds + kMaxBoundPrograms : 0;
  const std::uint32_t programs =
      passes * (kRounds + kMaxBoundPrograms + 2 * kMaxCorrections + cones);
  return {kRounds, friction ? kMaxFrictionRows : std::max(kMaxProxyRows, corrected),
          kMaxQpIterations, programs, programs * kMaxQpIterations};
}

/// Passes that a tick of a scene makes at most: none but of law kProxy. Where they are several, one
/// more may go on over a low step.
constexpr std::uint32_t proxy_passes(const SceneParameters& p) noexcept {
  if (p.law != LawId::kProxy) return 0;
  return p.coupling.passes + (p.coupling.passes > 1 ? 1 : 0);
}

/// Capacities and bounds of a scene of which a search at the goal visits at most `max_pair_visits`
/// pairs; all fields but state_bytes. Each total is the smaller of the sum
/// over all pairs and the visits times the largest pair. Saturating. Every pair must name pieces in
/// range, and words of `marks` (kNodeMarks) where it has any; where pairs are not listed `pairs` is
/// empty. O(pairs + pieces + marks).
constexpr SceneCapacity scene_capacity(std::span<const BodyRecord> bodies,
                                       std::span<const PieceRecord> pieces,
                                       std::span<const PairRecord> pairs,
                                       std::span<const std::uint64_t> marks,
                                       std::uint32_t max_pair_visits,
                                       const SceneParameters& parameters) noexcept {
  const auto clip = [](std::uint64_t x) {
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(x, UINT32_MAX));
  };
  SceneCapacity c{};
  const std::uint32_t pieces_a = bodies[0].piece_count;
  const std::uint64_t pieces_b = pieces.size() - pieces_a;
  const bool facets = has_facets(pieces);
  const bool listed = lists_pairs(parameters, pieces_a, pieces_b, facets);
  const std::uint64_t pair_count = listed ? pairs.size() : pieces_a * pieces_b;
  c.pair_count = clip(pair_count);
  c.max_pair_visits = max_pair_visits;
  const std::uint32_t passes = proxy_passes(parameters);
  const bool searches_goal = has_goal_contact(parameters);
  PairWork work{};
  std::uint64_t moving_lanes = 0;
  for (std::uint32_t i = 0; i < bodies[0].piece_count; ++i) {
    moving_lanes += pieces[bodies[0].piece_begin + i].lane_count;
  }
  c.moving_lanes = clip(moving_lanes);
  PairBounds sum{}, largest{};
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const PairRecord& pair = pairs[i];
    const PieceRecord& a = pieces[pair.piece_a];
    const PieceRecord& b = pieces[pair.piece_b];
    const NodeMarks own = pair.mark_begin == kNotMarked
                              ? NodeMarks{}
                              : marks_at(marks.subspan(pair.mark_begin).data(), pair, a, b);
    const PairBounds bounds = pair_bounds(a, b, pair, own);
    const auto add = [&](std::uint64_t PairBounds::*field) {
      sum.*field += bounds.*field;
      largest.*field = std::max(largest.*field, bounds.*field);
    };
    add(&PairBounds::feature_evaluations);
    add(&PairBounds::edge_pairs);
    add(&PairBounds::support_pairs);
    add(&PairBounds::near_nodes);
    const LiveCounts reachable = live_counts(own, NodeScope::kReachable, pair, a, b);
    const PairWork own_work = pair_work(a, b, pair, reachable);
    work.set = std::max(work.set, own_work.set);
    work.search = std::max(work.search, own_work.search);
    if (!searches_goal) continue;
    if (reachable.edge_pairs > pair.edge_pair_capacity) {
      c.unproven |= kUnprovenEdgePairs;
    }
    if (live_counts(own, NodeScope::kLive, pair, a, b).nodes > pair.near_capacity) {
      c.unproven |= kUnprovenNearSet;
    }
  }
  if (!listed) {
    const PieceRecord a = largest_counts(pieces.first(pieces_a));
    const PieceRecord b = largest_counts(pieces.subspan(pieces_a));
    const PairRecord pair = formed_pair(0, a, 0, b);
    largest = pair_bounds(a, b, pair, NodeMarks{});
    work = pair_work(a, b, pair, live_counts(NodeMarks{}, NodeScope::kReachable, pair, a, b));
    sum.feature_evaluations = pair_count * largest.feature_evaluations;
  }
  if (searches_goal && pair_count > max_pair_visits) c.unproven |= kUnprovenPairVisits;
  // Those that are not visited get a verdict.
  const std::uint64_t held = pair_count - std::min<std::uint64_t>(pair_count, max_pair_visits);
  PairBounds of_held{};
  of_held.support_pairs = kHeldSupportPairs;
  const auto total = [&](std::uint64_t PairBounds::*field) {
    return std::min(sum.*field, max_pair_visits * largest.*field) + held * of_held.*field;
  };
  c.total_features = clip(sum.feature_evaluations);
  c.largest_pair_features = clip(largest.feature_evaluations);
  c.largest_near = clip(largest.near_nodes);
  if (searches_goal) {
    c.max_support_pairs = clip(total(&PairBounds::support_pairs) + kGateSupportPairs * pair_count);
    c.max_feature_evaluations = clip(total(&PairBounds::feature_evaluations));
    c.max_edge_pairs = clip(total(&PairBounds::edge_pairs));
    c.max_near_nodes = clip(total(&PairBounds::near_nodes));
    // A pair that is held for want of budget has its last node.
    c.max_hull_points = clip(total(&PairBounds::near_nodes) + pair_count);
  } else {
    c.max_hull_points = c.largest_near;
  }
  if (passes == 0) return c;
  bool friction = false;
  for (const BodyRecord& body : bodies) friction = friction || body.friction > 0;
  const bool screened = is_screened(pieces, pieces_a);
  const std::uint32_t asked = parameters.coupling.near_pairs;
  c.near_slots = screened ? screened_slots(asked) : near_slots(c.pair_count, asked, facets);
  if (!screened && pair_count > c.near_slots) c.unproven |= kUnprovenNearPairs;
  const std::uint64_t visits = begun_visits(pieces, pieces_a, pair_count > c.near_slots) +
                               last_visits(work.search, !screened && pair_count > c.near_slots);
  c.max_work_units =
      clip(parameters.work_units +
           begun_units(work, near_looks(c.near_slots, parameters.coupling.near_pairs), visits,
                       friction, facets));
  c.max_list_visits = clip(kListVisitsOfUnit * std::uint64_t{parameters.work_units} + visits);
  c.max_full_searches = clip(std::min<std::uint64_t>(c.max_work_units, 2 * passes * pair_count));
  const ProgramBounds programs = program_bounds(pair_count, passes, friction);
  c.max_proxy_passes = c.max_proxy_rejected = passes;
  c.max_proxy_rounds = programs.rounds;
  c.max_qp_rows = programs.rows;
  c.max_qp_iterations = programs.iterations;
  c.max_qp_programs = programs.programs;
  c.max_qp_steps = std::min(programs.steps, c.max_work_units / kQpStepUnits);
  return c;
}

}  // namespace haptic
