// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The report of error against run time: what is asked for, what was measured, and the files.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "host_sim/lab/pareto/headline.hpp"
#include "host_sim/lab/pareto/pareto_measure.hpp"
#include "host_sim/lab/pareto/rendering_error.hpp"
#include "host_sim/lab/pareto/visit_budget.hpp"
#include "host_sim/report/picture.hpp"

namespace haptic::sim {

struct ParetoOptions {
  std::vector<std::string> pairs;  ///< names of pair classes and parts; empty: all
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
  double clock_step_ns = 0;               ///< smallest difference that the clock shows
  std::vector<HeadlineMeasure> headline;  ///< empty: not asked for
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

// The report of error against run time as text.

/// A table of times and a table of errors for each pair. Ratios are to the exhaustive search of the
/// same run in the same state.
[[nodiscard]] std::string pareto_markdown(const ParetoResult& result);

/// Machine, compiler, flags, seed, libraries, and every row with all of its fields. A value that a
/// method does not give is null.
[[nodiscard]] std::string pareto_json(const ParetoResult& result);

// Pictures of the report of error against run time (SVG). Both axes logarithmic.

/// Colour and shape of a method, the same in all pictures.
[[nodiscard]] MarkSign sign_of(std::string_view method);

/// A panel for each pair: largest depth error in contact against the median time, a mark for each
/// setting, the settings of one method joined.
[[nodiscard]] std::string error_time_plot(const ParetoResult& result);

/// Median time in contact against the pair's nodes, a line for each method in its drawn setting;
/// dashed: 99.9 %.
[[nodiscard]] std::string time_nodes_plot(const ParetoResult& result);

/// Time over the share of the contact poses that take longer, for the first and the fourth pair
/// class, or what there is of them.
[[nodiscard]] std::string latency_plot(const ParetoResult& result);

}  // namespace haptic::sim
