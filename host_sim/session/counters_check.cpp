// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/counters_check.hpp"

#include <algorithm>
#include <cstdio>

#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

struct Counter {
  const char* name;
  const char* words;
  std::uint32_t StepCounters::*peak;
  std::uint32_t SceneCapacity::*bound;
  bool proxy_only;
};

constexpr Counter kCounters[] = {
    {"pair_visits", "pairs visited", &StepCounters::pair_visits, &SceneCapacity::max_pair_visits,
     false},
    {"feature_evaluations", "faces and edges evaluated", &StepCounters::feature_evaluations,
     &SceneCapacity::max_feature_evaluations, false},
    {"edge_pairs", "pairs of edges", &StepCounters::edge_pairs, &SceneCapacity::max_edge_pairs,
     false},
    {"support_pairs", "support pairs", &StepCounters::support_pairs,
     &SceneCapacity::max_support_pairs, false},
    {"near_nodes", "near nodes", &StepCounters::near_nodes, &SceneCapacity::max_near_nodes, false},
    {"hull_points", "points of one contact region", &StepCounters::hull_points,
     &SceneCapacity::max_hull_points, false},
    {"work_units", "units of work", &StepCounters::work_units, &SceneCapacity::max_work_units,
     true},
    {"list_visits", "nodes of the trees of pieces", &StepCounters::list_visits,
     &SceneCapacity::max_list_visits, true},
    {"plane_gaps", "gaps along planes", &StepCounters::plane_gaps, &SceneCapacity::max_work_units,
     true},
    {"valid_nodes", "nodes of valid sets", &StepCounters::valid_nodes,
     &SceneCapacity::max_work_units, true},
    {"full_searches", "searches without history", &StepCounters::full_searches,
     &SceneCapacity::max_full_searches, true},
    {"search_work", "work of these searches", &StepCounters::search_work,
     &SceneCapacity::max_work_units, true},
    {"proxy_passes", "passes of the proxy", &StepCounters::proxy_passes,
     &SceneCapacity::max_proxy_passes, true},
    {"proxy_rejected", "rejected passes", &StepCounters::proxy_rejected,
     &SceneCapacity::max_proxy_rejected, true},
    {"proxy_rounds", "rounds of one pass", &StepCounters::proxy_rounds,
     &SceneCapacity::max_proxy_rounds, true},
    {"qp_rows", "rows of one program", &StepCounters::proxy_rows, &SceneCapacity::max_qp_rows,
     true},
    {"qp_iterations", "iterations of one program", &StepCounters::qp_iterations,
     &SceneCapacity::max_qp_iterations, true},
    {"qp_programs", "quadratic programs", &StepCounters::qp_programs,
     &SceneCapacity::max_qp_programs, true},
    {"qp_steps", "iterations of all programs", &StepCounters::qp_steps,
     &SceneCapacity::max_qp_steps, true}};

}  // namespace

std::vector<CounterBound> counter_bounds(const StepCounters& peaks, const SceneCapacity& capacity) {
  std::vector<CounterBound> bounds;
  for (const Counter& c : kCounters)
    bounds.push_back({c.name, c.words, peaks.*c.peak, capacity.*c.bound, c.proxy_only});
  return bounds;
}

bool all_held(const std::vector<CounterBound>& bounds) {
  return std::ranges::all_of(bounds, &CounterBound::held);
}

SceneCapacity damaged_bounds(const SceneCapacity& capacity, std::string_view name) {
  SceneCapacity damaged = capacity;
  for (const Counter& c : kCounters) {
    if (name != c.name) continue;
    damaged.*c.bound = 0;
    return damaged;
  }
  std::string known;
  for (const Counter& c : kCounters) known += (known.empty() ? "" : ", ") + std::string(c.name);
  throw tools::UsageError("--fault: the header has no bound '" + std::string(name) +
                          "'; its bounds are " + known);
}

std::uint64_t work_units(const StepCounters& c) {
  return std::uint64_t{c.pair_visits} + c.feature_evaluations + c.edge_pairs + c.support_pairs +
         c.near_nodes;
}

std::uint64_t work_bound(const SceneCapacity& c) {
  return std::uint64_t{c.max_pair_visits} + c.max_feature_evaluations + c.max_edge_pairs +
         c.max_support_pairs + c.max_near_nodes;
}

std::uint64_t proxy_units(const StepCounters& c) { return c.work_units; }

std::uint64_t proxy_bound(const SceneCapacity& c) { return c.max_work_units; }

bool within_bounds(const StepCounters& peaks, const SceneCapacity& capacity) {
  return std::ranges::all_of(kCounters,
                             [&](const Counter& c) { return peaks.*c.peak <= capacity.*c.bound; });
}

std::string counters_text(const std::vector<CounterBound>& bounds, bool proxy) {
  std::string text = "work per tick                       largest      bound\n";
  for (const CounterBound& b : bounds) {
    if (b.proxy_only && !proxy && b.held()) continue;
    char line[128];
    std::snprintf(line, sizeof line, "  %-28s %12u %10u%s\n", b.words, b.peak, b.bound,
                  b.held() ? "" : "  OVER ITS BOUND");
    text += line;
  }
  return text;
}

}  // namespace haptic::sim
