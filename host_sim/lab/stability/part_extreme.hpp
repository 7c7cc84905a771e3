// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Part 3 of the stability report: extreme geometry. Depth and normal against the exhaustive search
/// in long double, the wrench of a pressed contact against its closed form, and what is refused.

#include <cstdint>

#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// Runs every scene and contact in the scalar of this build; files extreme.{csv,md,svg} and
/// extreme_press.csv. Passes when nothing failed and what must be refused is.
/// Cost: about 25000 poses and 60000 ticks, most of it the search in long double; `quick`: a
/// fortieth.
[[nodiscard]] PartReport extreme_part(bool quick);

}  // namespace haptic::sim
