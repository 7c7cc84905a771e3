// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The work of a tick against the bounds that the header of its scene states.

#include <cstdint>
#include <iterator>
#include <string>

#include "rt_core/haptic_core.hpp"

namespace haptic::test {

struct CounterBound {
  const char* what;
  std::uint32_t StepCounters::*counter;
  std::uint32_t SceneCapacity::*bound;
};

inline constexpr CounterBound kCounterBounds[] = {
    {"pairs searched", &StepCounters::pair_visits, &SceneCapacity::max_pair_visits},
    {"support pairs", &StepCounters::support_pairs, &SceneCapacity::max_support_pairs},
    {"features", &StepCounters::feature_evaluations, &SceneCapacity::max_feature_evaluations},
    {"edge pairs", &StepCounters::edge_pairs, &SceneCapacity::max_edge_pairs},
    {"near nodes", &StepCounters::near_nodes, &SceneCapacity::max_near_nodes},
    {"points of a contact polygon", &StepCounters::hull_points, &SceneCapacity::max_hull_points},
    {"units of work", &StepCounters::work_units, &SceneCapacity::max_work_units},
    {"nodes of trees", &StepCounters::list_visits, &SceneCapacity::max_list_visits},
    {"gaps along planes", &StepCounters::plane_gaps, &SceneCapacity::max_work_units},
    {"nodes of valid sets", &StepCounters::valid_nodes, &SceneCapacity::max_work_units},
    {"searches without history", &StepCounters::full_searches, &SceneCapacity::max_full_searches},
    {"work of these searches", &StepCounters::search_work, &SceneCapacity::max_work_units},
    {"passes of the proxy", &StepCounters::proxy_passes, &SceneCapacity::max_proxy_passes},
    {"rejected passes", &StepCounters::proxy_rejected, &SceneCapacity::max_proxy_rejected},
    {"rounds of one pass", &StepCounters::proxy_rounds, &SceneCapacity::max_proxy_rounds},
    {"rows of one program", &StepCounters::proxy_rows, &SceneCapacity::max_qp_rows},
    {"iterations of one program", &StepCounters::qp_iterations, &SceneCapacity::max_qp_iterations},
    {"quadratic programs", &StepCounters::qp_programs, &SceneCapacity::max_qp_programs},
    {"iterations of all programs", &StepCounters::qp_steps, &SceneCapacity::max_qp_steps}};

// A new counter wants a line; stale_pairs alone has no bound of its own.
static_assert(sizeof(StepCounters) == (std::size(kCounterBounds) + 1) * sizeof(std::uint32_t));

/// The first counter above its bound; empty: none.
[[nodiscard]] inline std::string over_bound(const StepCounters& counters,
                                            const SceneCapacity& capacity) {
  for (const CounterBound& of : kCounterBounds) {
    if (counters.*of.counter > capacity.*of.bound) return of.what;
  }
  return {};
}

}  // namespace haptic::test
