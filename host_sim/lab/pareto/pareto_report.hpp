// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The report of error against run time: what is asked for, what was measured, and the files.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/pareto/pareto_measure.hpp"
#include "host_sim/lab/pareto/rendering_error.hpp"
#include "host_sim/lab/pareto/visit_budget.hpp"

namespace haptic::sim {

struct ParetoOptions {
  std::vector<std::string> pairs;  ///< names of pair classes, or kFieldName; empty: all
  bool quick = false;              ///< 2000 poses instead of 20000, and fewer visits of nodes
  std::uint64_t seed = 1;
  HeapCounter heap_calls = nullptr;
  bool progress = false;  ///< lines on stderr
};

/// One method on one pair, measured.
struct MethodMeasure {
  std::string method, setting;
  bool drawn = false;
  MethodResult result;
};

struct PairMeasure {
  std::string name, content;
  std::uint64_t nodes = 0;
  std::size_t poses = 0;
  double penetrating_share = 0;
  std::vector<MethodMeasure> methods;
};

struct ParetoResult {
  ParetoOptions options;
  MeasurePlan plan;
  double clock_empty_ns = 0;
  double clock_step_ns = 0;  ///< smallest difference that the clock shows
  std::vector<PairMeasure> pairs;
  std::vector<VisitBudget> budgets;     ///< of the field of posts; empty: not asked for
  std::vector<RenderingRow> rendering;  ///< empty: not asked for

  /// Of the pairs, then of the field.
  [[nodiscard]] std::vector<ParetoRow> rows() const;
};

/// @throws tools::InputError when a pair is not one of the classes.
[[nodiscard]] ParetoResult measure_pareto(const ParetoOptions& options);

/// pareto.csv, .json, .md and the pictures in `folder`, which is made.
void write_pareto(const ParetoResult& result, const std::string& folder);

}  // namespace haptic::sim
