// SPDX-License-Identifier: Apache-2.0
// A table of times and a table of errors for each pair.
#include <cmath>
#include <cstdio>

#include "host_sim/lab/pareto/pareto_report.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {
namespace {

std::string nanoseconds(double ns) {
  if (std::isnan(ns)) return "-";
  char buffer[32];
  if (ns < 9995) {
    std::snprintf(buffer, sizeof buffer, "%.0f", ns);
  } else if (ns < 999.5e3) {
    std::snprintf(buffer, sizeof buffer, "%.1fk", 1e-3 * ns);
  } else {
    std::snprintf(buffer, sizeof buffer, "%.2fM", 1e-6 * ns);
  }
  return buffer;
}

std::string number_shown(double value, const char* format = "%.2g") {
  if (std::isnan(value)) return "-";
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

/// A method's row in a state; null when it has none.
const ParetoRow* row_in(const PairMeasure& pair, const std::string& method,
                        const std::string& setting, PairState state) {
  for (const MethodMeasure& m : pair.methods) {
    if (m.method != method) continue;
    for (const ParetoRow& row : m.result.rows) {
      if (row.setting == setting && row.state == to_text(state)) return &row;
    }
  }
  return nullptr;
}

/// Largest figure next to the median: "median / p99 / p99.9 / largest".
std::string times(const ParetoRow* row) {
  if (row == nullptr) return "-";
  return nanoseconds(row->median_ns) + " / " + nanoseconds(row->p99_ns) + " / " +
         nanoseconds(row->p999_ns) + " / " + nanoseconds(row->max_ns);
}

/// Settings of a pair in order, first ticks included.
struct NamedSetting {
  std::string method, setting;
};
std::vector<NamedSetting> settings_of(const PairMeasure& pair) {
  std::vector<NamedSetting> names;
  for (const MethodMeasure& m : pair.methods) {
    for (const ParetoRow& row : m.result.rows) {
      if (names.empty() || names.back().method != row.method || names.back().setting != row.setting)
        names.push_back({row.method, row.setting});
    }
  }
  return names;
}

std::string time_table(const PairMeasure& pair) {
  std::string text = table_head({"method", "setting", "contact: query alone, median",
                                 "contact: median / p99 / p99.9 / largest", "exhaustive / this",
                                 "near: median / p99 / p99.9 / largest",
                                 "far: median / p99 / p99.9 / largest", "heap calls a query"});
  const ParetoRow* plain = row_in(pair, "exhaustive", "all nodes", PairState::kContact);
  for (const auto& [method, setting] : settings_of(pair)) {
    const ParetoRow* contact = row_in(pair, method, setting, PairState::kContact);
    const bool ratio = contact != nullptr && plain != nullptr && contact->median_ns > 0;
    text += table_row({method, setting, contact == nullptr ? "-" : nanoseconds(contact->query_ns),
                       times(contact),
                       ratio ? number_shown(plain->median_ns / contact->median_ns, "%.3g") : "-",
                       times(row_in(pair, method, setting, PairState::kNear)),
                       times(row_in(pair, method, setting, PairState::kFar)),
                       contact == nullptr ? "-" : number_shown(contact->heap_calls, "%.3g")});
  }
  return text + "\n";
}

std::string wrong_cell(const PairMeasure& pair, const std::string& method,
                       const std::string& setting) {
  std::uint64_t wrong = 0, poses = 0;
  for (const PairState state : {PairState::kContact, PairState::kNear, PairState::kFar}) {
    const ParetoRow* row = row_in(pair, method, setting, state);
    if (row == nullptr) continue;
    wrong += row->wrong_verdicts;
    poses += row->poses;
  }
  return std::to_string(wrong) + " of " + std::to_string(poses);
}

std::string error_table(const PairMeasure& pair) {
  std::string text = table_head({"method", "setting", "depth error (m): median",
                                 "largest, to 5 mm deep", "largest, deeper",
                                 "normal, largest error (deg)", "near: largest error of D_near (m)",
                                 "wrong verdicts", "points of the contact, mean"});
  for (const auto& [method, setting] : settings_of(pair)) {
    const ParetoRow* contact = row_in(pair, method, setting, PairState::kContact);
    const ParetoRow* near = row_in(pair, method, setting, PairState::kNear);
    if (contact == nullptr || method == "empty") continue;
    text += table_row(
        {method, setting, number_shown(contact->median_error_m), number_shown(contact->max_error_m),
         number_shown(contact->max_error_deep_m), number_shown(contact->normal_error_deg),
         near == nullptr ? "-" : number_shown(near->max_error_m), wrong_cell(pair, method, setting),
         number_shown(contact->patch_points, "%.3g")});
  }
  return text + "\n";
}

std::string remarks(const PairMeasure& pair) {
  std::string text;
  for (const MethodMeasure& m : pair.methods) {
    if (!m.result.refusal.empty())
      text += m.method + " refuses the pair: " + m.result.refusal + "\n\n";
    if (m.result.stride > 1) {
      text += m.method + ": every " + std::to_string(m.result.stride) +
              "th pose, for its time is that of the nodes.\n\n";
    }
  }
  const ParetoRow* plain = row_in(pair, "exhaustive", "all nodes", PairState::kContact);
  if (plain != nullptr) {
    text += "The exhaustive search takes " +
            number_shown(plain->median_ns / static_cast<double>(pair.nodes), "%.2f") +
            " ns a node.\n\n";
  }
  return text;
}

}  // namespace

std::string pair_sections(const ParetoResult& result) {
  if (result.pairs.empty()) return {};
  std::string text =
      std::string("## Depth error against run time\n\nTimes in ns of one call on one core, ") +
      TickClock::name() + ", its own " + number_shown(result.clock_empty_ns, "%.0f") +
      " ns subtracted (it counts in steps of " + number_shown(result.clock_step_ns, "%.2g") +
      " ns): per pose the least of " + std::to_string(result.plan.passes) +
      " passes in the order of the motion, then figures over the poses. `first tick`: the method "
      "made to forget before each call. Contact, near (less than 5 mm off) and far by the "
      "reference, an exhaustive search whose candidates are evaluated in long double. A verdict "
      "counts as wrong from 1 um on. `-`: the method gives no such value.\n\n"
      "![error against run time](error_time.svg)\n\n![time against nodes](time_nodes.svg)\n\n"
      "![latency](latency.svg)\n\n";
  for (const PairMeasure& pair : result.pairs) {
    text += "## " + pair.name + ": " + pair.content + ", " + std::to_string(pair.nodes) +
            " basic contacts\n\n" + std::to_string(pair.poses) + " poses, " +
            number_shown(100 * pair.penetrating_share, "%.1f") + " % in contact.\n\n" +
            time_table(pair) + error_table(pair) + remarks(pair);
  }
  return text;
}

}  // namespace haptic::sim
