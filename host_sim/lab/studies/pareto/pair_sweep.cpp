// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "host_sim/lab/pareto/pareto_report.hpp"

namespace haptic::sim {
namespace {

constexpr std::size_t kFullPoses = 20000, kQuickPoses = 2000;

void say(const ParetoOptions& options, const std::string& line) {
  if (options.progress) std::fprintf(stderr, "%s\n", line.c_str());
}

PairMeasure measure_pair(const PairClass& pair, const ParetoOptions& options,
                         const MeasurePlan& plan, const TickClock& clock) {
  PairMeasure measure{pair.name, pair.content, pair.nodes, 0, 0, {}};
  say(options,
      pair.name + ", " + pair.content + ", " + std::to_string(pair.nodes) + " nodes: reference");
  const TruthfulWorkload workload =
      truthful_workload(pair, options.quick ? kQuickPoses : kFullPoses, options.seed);
  measure.poses = workload.poses.size();
  measure.penetrating_share = workload.penetrating_share();
  for (const PeerEntry& entry : peer_catalog()) {
    if (entry.boxes_only && !pair.boxes) continue;
    say(options, "  " + entry.method + ", " + entry.setting);
    measure.methods.push_back({entry.method, entry.setting, entry.drawn,
                               measure_method(entry, pair, workload, plan, clock)});
    const std::string& refusal = measure.methods.back().result.refusal;
    if (!refusal.empty()) say(options, "    refused: " + refusal);
  }
  return measure;
}

}  // namespace

std::vector<PairMeasure> measure_pairs(std::span<const PairClass> classes,
                                       const ParetoOptions& options, const MeasurePlan& plan,
                                       const TickClock& clock) {
  std::vector<PairMeasure> measures;
  for (const PairClass& pair : classes)
    measures.push_back(measure_pair(pair, options, plan, clock));
  return measures;
}

}  // namespace haptic::sim
