// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/tick_csv.hpp"

#include <array>

#include "host_sim/report/part_report.hpp"

namespace haptic::sim {
namespace {

using tools::ShownField;
using tools::TickField;
using tools::TickKind;

std::span<const ShownField> shown_in(TickTable table, const GuideLegs& legs) {
  switch (table) {
    case TickTable::kCsv:
      return tools::fields_of<TickTable::kCsv>();
    case TickTable::kCsvGuide:
      return legs.empty() ? std::span<const ShownField>()
                          : tools::fields_of<TickTable::kCsvGuide>();
    case TickTable::kCsvPoses:
      return tools::fields_of<TickTable::kCsvPoses>();
    case TickTable::kCsvAdded:
      return tools::fields_of<TickTable::kCsvAdded>();
    default:
      return {};
  }
}

void append_cell(std::string& csv, const TickRecord& tick, const TickField& field,
                 const GuideLegs& legs) {
  switch (field.kind) {
    case TickKind::kNumber:
    case TickKind::kVector:
      for (std::size_t k = 0; k < field.count; ++k)
        append_number(k == 0 ? csv : csv += ',', number_of(tick, field, k));
      break;
    case TickKind::kQuaternion:
      for (const std::size_t k : {3u, 0u, 1u, 2u})
        append_number(k == 3 ? csv : csv += ',', number_of(tick, field, k));
      break;
    case TickKind::kHash:
      csv += tools::hash_text(count_of(tick, field));
      break;
    case TickKind::kSituation:
      csv += to_text(tick.situation);
      break;
    case TickKind::kRtStatus:
      csv += to_text(tick.status);
      break;
    case TickKind::kGuideState:
      csv += tools::to_text(tick.guide.state);
      break;
    case TickKind::kGuidePlace:
      csv += '"' + legs.place(tick.guide.state, tick.guide.station) + '"';
      break;
    case TickKind::kGuideLeg:
      csv += std::to_string(legs.leg_of(tick.guide.station) + 1);
      break;
    case TickKind::kGuideLegs:
      csv += std::to_string(legs.count());
      break;
    case TickKind::kCount:
    case TickKind::kFlags:
      csv += std::to_string(count_of(tick, field));
      break;
  }
}

constexpr TickTable kReplayTables[] = {TickTable::kCsv, TickTable::kCsvGuide, TickTable::kCsvPoses,
                                       TickTable::kCsvAdded};

}  // namespace

Vec3 grip_in_part(const SceneView& view) {
  const double* at = view.bodies()[0].reference_m;
  return {static_cast<Real>(at[0]), static_cast<Real>(at[1]), static_cast<Real>(at[2])};
}

std::string tick_columns(TickTable table, const GuideLegs& legs) {
  std::string columns;
  for (const ShownField& shown : shown_in(table, legs))
    columns.append(columns.empty() && table == TickTable::kCsv ? "" : ",").append(shown.name);
  return columns;
}

void append_cells(std::string& csv, TickTable table, const TickRecord& tick,
                  const GuideLegs& legs) {
  bool first = table == TickTable::kCsv;
  for (const ShownField& shown : shown_in(table, legs)) {
    if (!first) csv += ',';
    first = false;
    append_cell(csv, tick, *shown.field, legs);
  }
}

std::string tick_csv(std::span<const TickRecord> ticks, const GuideLegs& legs) {
  std::string csv;
  csv.reserve(400 + 480 * ticks.size());
  for (const TickTable table : kReplayTables) csv += tick_columns(table, legs);
  csv += '\n';
  for (const TickRecord& tick : ticks) {
    for (const TickTable table : kReplayTables) append_cells(csv, table, tick, legs);
    csv += '\n';
  }
  return csv;
}

}  // namespace haptic::sim
