// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pareto/pareto_report.hpp"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "host_sim/lab/pareto/headline_report.hpp"
#include "host_sim/lab/studies/reproduction/timing_table.hpp"
#include "host_sim/report/part_report.hpp"

#ifndef HAPTIC_BUILD_FLAGS
#define HAPTIC_BUILD_FLAGS "unknown"
#endif

namespace haptic::sim {
namespace {

using Json = nlohmann::ordered_json;

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

std::string short_number(double value, const char* format = "%.2g") {
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
                       ratio ? short_number(plain->median_ns / contact->median_ns, "%.3g") : "-",
                       times(row_in(pair, method, setting, PairState::kNear)),
                       times(row_in(pair, method, setting, PairState::kFar)),
                       contact == nullptr ? "-" : short_number(contact->heap_calls, "%.3g")});
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
        {method, setting, short_number(contact->median_error_m), short_number(contact->max_error_m),
         short_number(contact->max_error_deep_m), short_number(contact->normal_error_deg),
         near == nullptr ? "-" : short_number(near->max_error_m), wrong_cell(pair, method, setting),
         short_number(contact->patch_points, "%.3g")});
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
            short_number(plain->median_ns / static_cast<double>(pair.nodes), "%.2f") +
            " ns a node.\n\n";
  }
  return text;
}

/// The budgets of pair visits: what is saved, and what is then wrong.
std::string budget_section(const std::vector<VisitBudget>& budgets) {
  if (budgets.empty()) return {};
  std::string text =
      "## " + std::string(kFieldName) + ": a block over " + std::to_string(kFieldPosts) +
      " posts\n\nThe core alone, with a budget of pairs that a tick may visit; nearest first, the "
      "others keep their last plane and the tick is flagged. Force: largest difference from that "
      "with all pairs visited, which is " +
      short_number(budgets.back().force_n, "%.2f") + " N at most.\n\n";
  text +=
      table_head({"setting", "contact: median / p99 / p99.9 / largest", "depth error (m): median",
                  "largest", "wrong verdicts", "points of the contact, mean",
                  "ticks with a pair left out (%)", "largest error of the force (N)"});
  for (const VisitBudget& budget : budgets) {
    const ParetoRow* contact = nullptr;
    std::uint64_t wrong = 0, poses = 0;
    for (const ParetoRow& row : budget.result.rows) {
      if (row.state == to_text(PairState::kContact)) contact = &row;
      wrong += row.wrong_verdicts;
      poses += row.poses;
    }
    if (contact == nullptr) continue;
    text += table_row(
        {contact->setting, times(contact), short_number(contact->median_error_m),
         short_number(contact->max_error_m), std::to_string(wrong) + " of " + std::to_string(poses),
         short_number(contact->patch_points, "%.3g"), short_number(100 * budget.held_share, "%.1f"),
         short_number(budget.force_error_n)});
  }
  return text + "\n";
}

/// The proxy law: what a tick costs with fewer passes, and what its wrench is then worth.
std::string rendering_section(const std::vector<RenderingRow>& rows) {
  if (rows.empty()) return {};
  std::string text =
      "## rendering: the proxy law\n\n![force error against the median tick](rendering.svg)\n\n"
      "Force and torque against those of " +
      std::to_string(kReferencePasses) + " passes in " + std::to_string(kReferenceSubsteps) +
      " sub-steps of every tick. The default is three passes.\n\n" +
      table_head({"contact", "passes", "tolerance (m)", "tick (us): median / p99 / largest",
                  "force error (N): median / p99 / largest", "largest torque error (N m)",
                  "worst gap (m)", "heap calls"});
  for (const RenderingRow& r : rows) {
    text += table_row(
        {r.contact, std::to_string(r.passes),
         r.tolerance_m > 0 ? short_number(r.tolerance_m) : std::string("derived"),
         short_number(r.median_ns / 1e3, "%.2f") + " / " + short_number(r.p99_ns / 1e3, "%.2f") +
             " / " + short_number(r.max_ns / 1e3, "%.2f"),
         short_number(r.median_force_error_n) + " / " + short_number(r.p99_force_error_n) + " / " +
             short_number(r.max_force_error_n),
         short_number(r.max_torque_error_nm), short_number(r.worst_gap_m),
         short_number(r.heap_calls)});
  }
  return text + "\n";
}

std::string libraries_text() {
  std::string built, missing;
  for (const PeerLibrary& library : peer_libraries()) {
    std::string& list = library.built ? built : missing;
    list += (list.empty() ? "" : ", ") + library.name +
            (library.built ? " " + library.version + " (" + library.licence + ")" : "");
  }
  return (built.empty() ? std::string("none") : built) +
         (missing.empty() ? "" : "; not found when this was built: " + missing);
}

}  // namespace

std::string pareto_markdown(const ParetoResult& result) {
  std::string text =
      "# Error against run time\n\nMachine: " + processor_name() +
      ". Compiler: " __VERSION__ ", " HAPTIC_BUILD_FLAGS ". Seed " +
      std::to_string(result.options.seed) +
      ". Libraries, versions as their pkg-config files have them: " + libraries_text() + ".\n\n" +
      headline_markdown(result.headline);
  if (!result.pairs.empty() || !result.budgets.empty()) {
    text +=
        std::string("## Depth error against run time\n\nTimes in ns of one call on one core, ") +
        TickClock::name() + ", its own " + short_number(result.clock_empty_ns, "%.0f") +
        " ns subtracted (it counts in steps of " + short_number(result.clock_step_ns, "%.2g") +
        " ns): per pose the least of " + std::to_string(result.plan.passes) +
        " passes in the order of the motion, then figures over the poses. `first tick`: the method "
        "made to forget before each call. Contact, near (less than 5 mm off) and far by the "
        "reference, an exhaustive search whose candidates are evaluated in long double. A verdict "
        "counts as wrong from 1 um on. `-`: the method gives no such value.\n\n";
  }
  if (!result.pairs.empty()) {
    text +=
        "![error against run time](error_time.svg)\n\n![time against nodes](time_nodes.svg)\n\n"
        "![latency](latency.svg)\n\n";
  }
  for (const PairMeasure& pair : result.pairs) {
    text += "## " + pair.name + ": " + pair.content + ", " + std::to_string(pair.nodes) +
            " basic contacts\n\n" + std::to_string(pair.poses) + " poses, " +
            short_number(100 * pair.penetrating_share, "%.1f") + " % in contact.\n\n" +
            time_table(pair) + error_table(pair) + remarks(pair);
  }
  return text + budget_section(result.budgets) + rendering_section(result.rendering);
}

std::string pareto_json(const ParetoResult& result) {
  Json json;
  json["machine"] = processor_name();
  json["compiler"] = __VERSION__;
  json["flags"] = HAPTIC_BUILD_FLAGS;
  json["seed"] = result.options.seed;
  json["passes"] = result.plan.passes;
  json["clock"] = TickClock::name();
  json["clock_empty_ns"] = result.clock_empty_ns;
  json["clock_step_ns"] = result.clock_step_ns;
  for (const PeerLibrary& library : peer_libraries()) {
    json["libraries"].push_back({{"name", library.name},
                                 {"version", library.version},
                                 {"licence", library.licence},
                                 {"built", library.built}});
  }
  for (const PairMeasure& pair : result.pairs) {
    Json entry{{"name", pair.name},
               {"content", pair.content},
               {"nodes", pair.nodes},
               {"poses", pair.poses},
               {"penetrating_share", pair.penetrating_share},
               {"refusals", Json::array()}};
    for (const MethodMeasure& m : pair.methods) {
      if (!m.result.refusal.empty())
        entry["refusals"].push_back({{"method", m.method}, {"why", m.result.refusal}});
    }
    json["pairs"].push_back(std::move(entry));
  }
  if (!result.headline.empty()) json["headline"] = headline_table(result.headline).json();
  for (const VisitBudget& budget : result.budgets) {
    json["visit_budgets"].push_back({{"visits", budget.visits},
                                     {"held_share", budget.held_share},
                                     {"force_error_n", budget.force_error_n},
                                     {"force_n", budget.force_n}});
  }
  if (!result.rendering.empty())
    json["rendering"] = rendering_table(result.rendering).json({"heap_calls"});
  if (const auto rows = result.rows(); !rows.empty()) json["rows"] = pareto_rows(rows).json();
  return json.dump(2) + "\n";
}

}  // namespace haptic::sim
