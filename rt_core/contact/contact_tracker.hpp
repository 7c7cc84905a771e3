// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Keeps the nearest C-faces of one C-obstacle between two servo ticks: the paper's steps 1-6 (Sec.
/// III) as completed by method section 6. One hop over the stored graph from the last near set, no
/// pruning by delta, D_near from true support values, exact ties crossed. What the local set cannot
/// answer is flagged and answered by an exhaustive search.

#include <cstdint>
#include <span>

#include "rt_core/base/bounded_list.hpp"
#include "rt_core/contact/basic_contact.hpp"
#include "rt_core/contact/contact_graph.hpp"
#include "rt_core/contact/pair_verdict.hpp"

namespace haptic {

/// A node of the near set at the current pose.
struct NearNode {
  std::uint32_t node = 0;
  ContactType type = ContactType::kA;
  NodePlane plane;
  Real violation_m = 0;
  Real value_m = 0;  ///< node_value; only where the node counts for D_near
};

/// What one pair keeps from tick to tick. `near` has the pair's near capacity.
struct PairTrack {
  BoundedList<NearNode> near;  ///< ascending by node
  std::uint32_t best_node =
      0;  ///< node of D_near; with ties the one of best conditioning, lowest number
  Real d_near_m = 0;
  std::uint32_t neighborhood_size = 0;  ///< of the neighbor subgraph evaluated in the last tick
  VerdictMemory verdict;
  std::uint32_t audit_next = 0;  ///< face direction to be looked at next: faces of A, then of B
  std::uint32_t audit_node = 0;  ///< node to be looked at next
  SupportPair audit_support;     ///< where the last audit's climbs ended
  bool valid = false;            ///< false: the next tick is a first tick
};

/// Memory shared by all pairs within a tick.
struct TrackerScratch {
  NodeSet reached;            ///< nodes evaluated in this tick; capacity of the largest pair
  std::span<Real> reached_f;  ///< f of each of them; the lowest number once it needs no second look
  /// Evaluated nodes not far below the best; kCandidateFactor near capacities.
  BoundedList<NearNode> candidates;
};

/// Room for candidates, in units of the largest near capacity: those of the last best plane and of
/// the new one.
inline constexpr std::uint32_t kCandidateFactor = 4;

/// Face directions looked at per tick beside the neighbor subgraph.
inline constexpr std::uint32_t kAuditFaces = 16;
/// Nodes of any kind looked at per tick beside it.
inline constexpr std::uint32_t kAuditNodes = 4;

/// Nodes that one tick looks at beyond the tied ones, best first, to expand them if they apply.
inline constexpr std::uint32_t kRunnersUp = 8;

/// Nodes that one tick may reach by looking beyond the neighbor subgraph: the paper's largest (72),
/// or two nodes of the pair's largest degree.
[[nodiscard]] constexpr std::uint32_t expansion_budget(const PairRecord& pair) noexcept {
  return 2 * (pair.max_degree + 1) > 72 ? 2 * (pair.max_degree + 1) : 72;
}

/// Motion of A since the last tick, for the bound on how much a gap can have changed.
struct PairMotion {
  Real bound_m =
      0;  ///< |dx| + largest lever * turn: no support gap of a fixed direction falls by more
};

enum TrackFlag : std::uint32_t {
  kTrackRelocalised = 1u << 0,
  kTrackFirst = 1u << 1,
  kTrackEmpty = 1u << 2,
  kTrackContradiction = 1u << 3,
  kTrackNearCut = 1u << 4,
  kTrackUndecided = 1u << 5,
  kTrackOverflow = 1u << 6
};

struct TrackResult {
  std::uint32_t flags = 0;
  std::uint32_t nodes_evaluated = 0;
  std::uint32_t support_pairs = 0;
};

/// One tick of one pair (paper Sec. III, steps 1-6). `epsilon_m` is the paper's epsilon.
/// After it `track.d_near_m` is the largest value over the applicable nodes reached; > 0 is
/// certified by the support gap of a direction, <= 0 agrees with a certified verdict. Cost: at most
/// nodes_evaluated_bound node evaluations.
[[nodiscard]] TrackResult track_pair(const PairPose& pose, const PairMotion& motion, Real epsilon_m,
                                     PairTrack& track, TrackerScratch& scratch) noexcept;

}  // namespace haptic
