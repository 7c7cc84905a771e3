// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Records of ticks as CSV, by the list of their fields (tools/verdict/tick_record.hpp).

#include <cmath>
#include <span>
#include <string>

#include "tools/plan/guide_legs.hpp"
#include "tools/verdict/flag_names.hpp"
#include "tools/verdict/tick_record.hpp"

namespace haptic::sim {

using tools::GuideLegs;
using tools::kFlagCount;
using tools::kFlagLocalSetEmpty;
using tools::record_of;
using tools::TickGuide;
using tools::TickRecord;
using tools::TickTable;

[[nodiscard]] inline double length_of(const double (&v)[3]) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/// Grip point of the scene's moving part in A's mesh frame [m].
[[nodiscard]] Vec3 grip_in_part(const SceneView& view);

/// Columns of one of the tables kCsv.. without the end of line, each but the very first of a line
/// with a comma before it. Those of the guide are empty in a scene without one.
[[nodiscard]] std::string tick_columns(TickTable table, const GuideLegs& legs = {});

/// Appends the cells below these columns, 17 significant digits. guide_place: GuideLegs::place, in
/// quotation marks.
void append_cells(std::string& csv, TickTable table, const TickRecord& tick,
                  const GuideLegs& legs = {});

/// CSV of a replay, its columns as COLUMNS.md has them: kCsv, kCsvGuide, kCsvPoses, kCsvAdded; LF.
[[nodiscard]] std::string tick_csv(std::span<const TickRecord> ticks, const GuideLegs& legs = {});

}  // namespace haptic::sim
