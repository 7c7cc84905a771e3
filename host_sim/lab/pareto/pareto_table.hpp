// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The report of error against run time as text.

#include <string>

#include "host_sim/lab/pareto/pareto_report.hpp"

namespace haptic::sim {

/// A table of times and a table of errors for each pair. Ratios are to the exhaustive search of the
/// same run in the same state.
[[nodiscard]] std::string pareto_markdown(const ParetoResult& result);

/// Machine, compiler, flags, seed, libraries, and every row with all of its fields. A value that a
/// method does not give is null.
[[nodiscard]] std::string pareto_json(const ParetoResult& result);

}  // namespace haptic::sim
