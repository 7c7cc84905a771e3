// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Pictures of error against run time over the pair classes (SVG). Both axes logarithmic.

#include <string>
#include <string_view>

#include "host_sim/lab/pareto/pareto_report.hpp"
#include "host_sim/report/picture.hpp"

namespace haptic::sim {

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
