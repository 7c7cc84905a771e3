// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Error against run time for rendering: the proxy law with few and many passes and several
/// tolerances, its wrench against that of twenty passes in quarter steps of the same motion.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/pareto/pareto_measure.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// Name under which it is asked for.
inline constexpr const char* kRenderingName = "rendering";
/// Passes and sub-steps of the reference.
inline constexpr std::uint32_t kReferencePasses = 20, kReferenceSubsteps = 4;

/// One case with one setting. Errors: length of the difference of force and of torque from the
/// reference, over all ticks of the path.
struct RenderingRow {
  std::string contact, scalar;
  std::uint32_t passes = 0;
  double tolerance_m = 0;  ///< 0: the one derived from the part's size
  double median_ns = 0, p99_ns = 0, max_ns = 0;
  double median_force_error_n = 0, p99_force_error_n = 0, max_force_error_n = 0;
  double max_torque_error_nm = 0;
  double worst_gap_m = 0;
  double heap_calls = 0;  ///< mean over the ticks; NaN: not counted
  std::uint64_t ticks = 0;
};

/// Passes 1, 2, 3, 5 with the derived tolerance, and three passes with a tenth and ten times of it,
/// on a tilting, a rolling and a sliding contact, five pieces with seams, and a peg in its hole.
/// Each setting runs `plan.passes` times; the least time of a tick counts.
[[nodiscard]] std::vector<RenderingRow> measure_rendering(const MeasurePlan& plan,
                                                          const TickClock& clock, bool quick);

[[nodiscard]] ReportTable rendering_table(const std::vector<RenderingRow>& rows);

/// A panel per contact: p99 of the force error against the median tick.
[[nodiscard]] std::string rendering_plot(const std::vector<RenderingRow>& rows);

}  // namespace haptic::sim
