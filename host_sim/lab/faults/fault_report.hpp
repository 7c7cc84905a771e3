// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The fault matrix as files.

#include <vector>

#include "host_sim/lab/faults/fault_matrix.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// faults.csv (a line per cell), faults.md (semantics, matrix, failures), faults.svg. Equal
/// verdicts, equal bytes.
[[nodiscard]] std::vector<OutputText> fault_files(const std::vector<FaultVerdict>& verdicts,
                                                  const FaultMatrixOptions& options);

}  // namespace haptic::sim
