// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Fig. 5 of the paper: force and torque while the contacts of Fig. 4 (left) are attained one after
/// the other.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/session/tick_record.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

struct ForceRun {
  std::vector<TickRecord> ticks;           ///< 1 kHz
  std::vector<std::uint32_t> contacts;     ///< K per tick
  std::vector<ContactSituation> sequence;  ///< situations in their order, changes only
};

/// No contact, App_1 (a vertex of B under a face of A), (App_1, App_2) with the edge of B in the
/// face, then face-face. A turns about App_1 at a constant depth of 2 mm.
[[nodiscard]] ForceRun make_force_run();

[[nodiscard]] PartReport forces_part();

}  // namespace haptic::sim
