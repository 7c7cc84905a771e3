// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The capacities and bounds that a scene's header states (scene_format.hpp).

#include <cstdint>

namespace haptic {

/// Fixed capacities and bounds of one tick, computed from the tables (scene/capacity.hpp). A tick
/// visits at most `max_pair_visits` pairs, nearest first; the other bounds hold for any such
/// choice.
struct SceneCapacity {
  std::uint64_t state_bytes;   ///< memory of one HapticCore for this scene, 64-bit addresses
  std::uint32_t moving_lanes;  ///< padded vertices of all pieces of A
  std::uint32_t pair_count;
  std::uint32_t total_features;  ///< faces and edges of both pieces, over all pairs
  std::uint32_t largest_pair_features;
  std::uint32_t largest_near;     ///< largest near capacity of a pair
  std::uint32_t max_pair_visits;  ///< pairs searched in one tick
  std::uint32_t max_support_pairs;
  std::uint32_t max_feature_evaluations;  ///< faces and edges whose bound is computed
  std::uint32_t max_edge_pairs;           ///< pairs of active edges tested
  std::uint32_t max_near_nodes;           ///< of all near sets together
  std::uint32_t max_hull_points;          ///< points of one contact polygon
  /// Law kProxy, else 0: gaps along C-face planes, nodes of valid sets, searches without history.
  std::uint32_t max_plane_gaps, max_valid_nodes, max_full_searches;
  std::uint32_t max_search_work;  ///< of those searches: as StepCounters::search_work
  std::uint32_t max_proxy_passes, max_proxy_rejected;
  std::uint32_t max_proxy_rounds;                ///< of one pass
  std::uint32_t max_qp_rows, max_qp_iterations;  ///< of one quadratic program
  std::uint32_t max_qp_programs, max_qp_steps;   ///< programs, and iterations of them all together
  std::uint32_t unproven;                        ///< UnprovenBound, bit set = cannot be defended
  std::uint32_t reserved;                        ///< 0

  friend constexpr bool operator==(const SceneCapacity&, const SceneCapacity&) noexcept = default;
};

/// Why a scene cannot be certified. The work of a tick is bounded in every case; these bits say
/// that a tick might have to give up exactness, with a flag, to keep to it.
enum UnprovenBound : std::uint32_t {
  kUnprovenEdgePairs = 1u << 0,  ///< a pair has more pairs of edges than a tick may test
  kUnprovenNearSet = 1u << 1,    ///< a pair has more nodes than its near set may hold
  kUnprovenPairVisits = 1u << 2  ///< more pairs can be near at once than a tick may visit
};

}  // namespace haptic
