// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The report of error against run time: what is asked for, what was measured, and the files.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/pareto/headline.hpp"
#include "host_sim/lab/pareto/opponents.hpp"
#include "host_sim/lab/pareto/pareto_measure.hpp"

namespace haptic::sim {

struct ParetoOptions {
  std::vector<std::string>
      pairs;  ///< names of pair classes, the headline, the opponents; empty: all of this build
  bool quick = false;  ///< 2000 poses instead of 20000, and fewer visits of nodes
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
  double clock_step_ns = 0;                ///< smallest difference that the clock shows
  std::vector<HeadlineMeasure> headline;   ///< empty: not asked for
  std::vector<OpponentMeasure> opponents;  ///< empty: not asked for
  std::vector<PairMeasure> pairs;

  [[nodiscard]] std::vector<ParetoRow> rows() const;
};

/// @throws tools::InputError when a pair is not one of the classes; tools::UsageError when one is
/// named and the studies are not built.
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

// The pair classes, one of the studies (lab/studies/pareto); without it there are none.

[[nodiscard]] std::vector<PairMeasure> measure_pairs(std::span<const PairClass> classes,
                                                     const ParetoOptions& options,
                                                     const MeasurePlan& plan,
                                                     const TickClock& clock);
/// A section a pair for people, heading included; empty without pairs.
[[nodiscard]] std::string pair_sections(const ParetoResult& result);
/// error_time.svg, time_nodes.svg, latency.svg; none without pairs.
[[nodiscard]] std::vector<OutputText> pair_pictures(const ParetoResult& result);

}  // namespace haptic::sim
