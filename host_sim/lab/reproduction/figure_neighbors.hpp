// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Fig. 8 of the paper: a type-B basic contact and some of its G-neighbors.

#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

[[nodiscard]] PartReport neighbors_part();

}  // namespace haptic::sim
