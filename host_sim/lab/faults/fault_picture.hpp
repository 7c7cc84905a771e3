// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The fault matrix as small multiples: force against time, one row per fault, one curve per state.

#include <string>
#include <vector>

#include "host_sim/lab/faults/fault_matrix.hpp"

namespace haptic::sim {

/// Left what was handed to the bus, right what acted at the device. `verdicts` in the order of
/// run_fault_matrix.
[[nodiscard]] std::string fault_picture(const std::vector<FaultVerdict>& verdicts);

}  // namespace haptic::sim
