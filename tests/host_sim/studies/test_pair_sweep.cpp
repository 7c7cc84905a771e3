// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <string>

#include "host_sim/lab/studies/pareto/pair_plot.hpp"

using namespace haptic;
using namespace haptic::sim;

TEST_SUITE_BEGIN("host_sim.pair_sweep");

TEST_CASE("report: tables, JSON and pictures of a short run") {
  ParetoResult result;
  MeasurePlan plan;
  plan.passes = 1;
  result.plan = plan;
  const TickClock clock;
  const PairClass pair = pair_classes(1)[1];
  const TruthfulWorkload workload = truthful_workload(pair, 160, 2);
  PairMeasure measure{pair.name, pair.content, pair.nodes, 160, workload.penetrating_share(), {}};
  for (const PeerEntry& entry : peer_catalog())
    measure.methods.push_back({entry.method, entry.setting, entry.drawn,
                               measure_method(entry, pair, workload, result.plan, clock)});
  result.pairs.push_back(std::move(measure));
  const std::string markdown = pareto_markdown(result), json = pareto_json(result);
  for (const PeerEntry& entry : peer_catalog()) {
    CHECK(markdown.find("| " + entry.method + " | " + entry.setting) != std::string::npos);
    CHECK(json.find("\"" + entry.method + "\"") != std::string::npos);
  }
  CHECK(markdown.find("| ours | first tick") != std::string::npos);
  CHECK(markdown.find("nan") == std::string::npos);
  for (const std::string& svg :
       {error_time_plot(result), time_nodes_plot(result), latency_plot(result)}) {
    CHECK(svg.starts_with("<?xml "));
    CHECK(svg.ends_with("</svg>\n"));
    CHECK(svg.find("nan") == std::string::npos);
    CHECK(svg.find("inf") == std::string::npos);
    CHECK(svg.find(sign_of("exhaustive").colour) != std::string::npos);
  }
}

TEST_SUITE_END();
