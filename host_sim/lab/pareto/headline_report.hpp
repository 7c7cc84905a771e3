// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Table, pages and picture of the headline.

#include <string>
#include <vector>

#include "host_sim/lab/pareto/headline.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// A row per scene and method: times, errors, steps, and both ratios to the default law.
[[nodiscard]] ReportTable headline_table(const std::vector<HeadlineMeasure>& measures);

/// Every tick in contact of one scene, a line each: time and errors of every method.
[[nodiscard]] std::string headline_ticks_csv(const HeadlineMeasure& measure);

/// The section for people, headings of the second level, one figure a cell.
[[nodiscard]] std::string headline_markdown(const std::vector<HeadlineMeasure>& measures);

/// A row of panels per scene: force error, torque error and time of a tick, a violin per method.
[[nodiscard]] std::string headline_plot(const std::vector<HeadlineMeasure>& measures);

}  // namespace haptic::sim
