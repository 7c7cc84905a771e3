// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a budget of pair visits costs and saves: one block over a field of posts, most of which are
/// near at once, with the core allowed to visit fewer pairs in a tick than are near.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/pareto/pareto_measure.hpp"

namespace haptic::sim {

/// Name in `pair` of the rows.
inline constexpr const char* kFieldName = "field";
inline constexpr std::uint32_t kFieldPosts = 36;

/// The block, and the posts of one static body, their tops within 0.6 mm of z = 0.
struct PostField {
  Solid block;
  std::vector<Solid> posts;
};
[[nodiscard]] PostField post_field(std::uint64_t seed);

/// One recording of 1 kHz: the block sways and dips between 2 mm over the posts and 1.2 mm into
/// them, at less than 0.3 m/s and 3 rad/s. Truth: the smallest D_near over all posts, of the
/// exhaustive search of each.
[[nodiscard]] TruthfulWorkload field_workload(const PostField& field, std::size_t pose_count,
                                              std::uint64_t seed);

/// The core on the field with a budget, measured as the other methods are.
struct VisitBudget {
  std::uint32_t visits = 0;  ///< allowed in a tick
  MethodResult result;       ///< setting "visits N"
  double held_share = 0;     ///< of the ticks: a near pair was not visited, flagged
  double force_error_n = 0;  ///< largest difference of the force from that with all pairs visited
  double force_n = 0;        ///< largest force with all pairs visited
};

/// One entry per budget, the largest last: 1, 2, 4, 8, 16 and all. Cost: the exhaustive truth of
/// every post and pose, then seven passes over the motion per budget.
[[nodiscard]] std::vector<VisitBudget> measure_visit_budgets(std::size_t pose_count,
                                                             std::uint64_t seed,
                                                             const MeasurePlan& plan,
                                                             const TickClock& clock);

}  // namespace haptic::sim
