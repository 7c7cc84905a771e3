// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Time of one tick of the core against the 0.1 to 0.6 ms of the paper (Sec. IV-B).

#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// Numbers of the machine: the only part that differs from run to run.
[[nodiscard]] PartReport timing_part(const ReproductionSize& size);

}  // namespace haptic::sim
