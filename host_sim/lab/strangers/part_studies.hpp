// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Does a part freeze where more pairs of pieces are near at once than the core follows? Shafts of
/// many facets in their bores, splines and connectors of many pins, with the compiler's number of
/// near pairs, with few, and with all of them.

#include <optional>
#include <string>

#include "host_sim/lab/strangers/stranger_judge.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/report/shard_run.hpp"

namespace haptic::sim {

struct StudySize {
  bool is_short = false;
  bool instructions = false;           ///< count them, where valgrind is there
  std::optional<StrangerFault> fault;  ///< made on purpose
};

/// freeze.csv and .md. Failed: a tick with force in the open, or a force other than that of the
/// full list in a tick without a flag.
[[nodiscard]] PartReport freeze_study(const StudySize& size, const RunOptions& options);
/// seams.csv and .md: a cube drawn over steps of 0 to 100 um between fixed parts, between sheets,
/// and over a torn mesh. Failed: a force along the way at a step that nobody makes, or none at one
/// that is a step.
[[nodiscard]] PartReport seam_study(const StudySize& size, const RunOptions& options);
/// recovery.csv and .md: starts inside clusters of boxes, and motions over surfaces that start
/// free. Failed: a part that is neither led out nor said to be inside; recovery after a free start.
[[nodiscard]] PartReport recovery_study(const StudySize& size, const RunOptions& options);

}  // namespace haptic::sim
