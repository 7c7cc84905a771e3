// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pareto/pareto_report.hpp"

#include <nlohmann/json.hpp>

#include "host_sim/lab/pareto/headline_report.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/timing/processor_name.hpp"

#ifndef HAPTIC_BUILD_FLAGS
#define HAPTIC_BUILD_FLAGS "unknown"
#endif

namespace haptic::sim {
namespace {

using Json = nlohmann::ordered_json;

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
  const std::string text =
      "# Error against run time\n\nMachine: " + processor_name() +
      ". Compiler: " __VERSION__ ", " HAPTIC_BUILD_FLAGS ". Seed " +
      std::to_string(result.options.seed) +
      ". Libraries, versions as their pkg-config files have them: " + libraries_text() + ".\n\n" +
      headline_markdown(result.headline) + opponent_markdown(result.opponents);
  return text + pair_sections(result);
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
  if (!result.opponents.empty()) json["opponents"] = opponent_table(result.opponents).json();
  if (const auto rows = result.rows(); !rows.empty()) json["rows"] = pareto_rows(rows).json();
  return json.dump(2) + "\n";
}

}  // namespace haptic::sim
