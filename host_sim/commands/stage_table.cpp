// SPDX-License-Identifier: Apache-2.0
#include "host_sim/commands/stage_table.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "host_sim/commands/plan_account.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using Json = nlohmann::ordered_json;

Json row_json(const StageRow& row) {
  Json json{{"stage", row.number}, {"part", row.part}, {"found", row.failure.empty()}};
  if (!row.failure.empty()) {
    json["failure"] = row.failure;
    return json;
  }
  json["how"] = row.how;
  json["length_m"] = row.length_m;
  json["clearance_m"] = row.clearance_m;
  json["steps"] = row.steps;
  json["certified"] = row.certified;
  if (row.settled_m > 0) json["settled_m"] = row.settled_m;
  return json;
}

}  // namespace

int say_rows(const std::vector<StageRow>& rows, bool as_json, Json json) {
  const auto failed =
      std::ranges::find_if(rows, [](const StageRow& r) { return !r.failure.empty(); });
  const bool is_good = failed == rows.end();
  if (as_json) {
    json["stages"] = Json::array();
    for (const StageRow& row : rows) json["stages"].push_back(row_json(row));
    std::printf("%s\n", json.dump(2).c_str());
    return is_good ? tools::kExitDone : tools::kExitCheckFailed;
  }
  std::size_t wide = 4;
  for (const StageRow& row : rows) wide = std::max(wide, row.part.size());
  std::printf("stage  %-*s  %-8s  %10s  %10s  proved\n", static_cast<int>(wide), "part", "way",
              "length", "clearance");
  for (const StageRow& row : rows) {
    std::printf("%5zu  %-*s  ", row.number, static_cast<int>(wide), row.part.c_str());
    if (!row.failure.empty()) {
      std::printf("%-8s  %s\n", "none", row.failure.c_str());
      continue;
    }
    std::printf(
        "%-8s  %10s  %10s  %llu of %llu steps\n", row.how.c_str(),
        millimetres_or_less(row.length_m).c_str(), millimetres_or_less(row.clearance_m).c_str(),
        static_cast<unsigned long long>(row.certified), static_cast<unsigned long long>(row.steps));
  }
  for (const StageRow& row : rows) {
    if (row.settled_m == 0) continue;
    std::printf("%s overlaps at its goal by rounding: its plan ends %s from there, free\n",
                in_quotes(row.part).c_str(), millimetres_or_less(row.settled_m).c_str());
  }
  if (!is_good) {
    std::printf("stage %zu, %s: %s\n", failed->number, in_quotes(failed->part).c_str(),
                failed->failure.c_str());
    return tools::kExitCheckFailed;
  }
  std::printf("%s\n", rows.size() == 1
                          ? tools::formatted("stage %zu is proved", rows[0].number).c_str()
                          : tools::formatted("all %zu stages are proved", rows.size()).c_str());
  return tools::kExitDone;
}

}  // namespace haptic::sim
