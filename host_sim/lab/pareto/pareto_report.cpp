// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pareto/pareto_report.hpp"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <set>
#include <system_error>

#include "host_sim/lab/pareto/headline_report.hpp"
#include "host_sim/report/part_report.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

constexpr std::size_t kFullPoses = 20000, kQuickPoses = 2000;
constexpr std::size_t kFullFieldPoses = 5000, kQuickFieldPoses = 1000;

MeasurePlan plan_of(const ParetoOptions& options) {
  MeasurePlan plan;
  if (options.quick) {
    plan.node_visits = 250'000'000;
    plan.first_ticks = 100;
  }
  plan.heap_calls = options.heap_calls;
  return plan;
}

std::vector<PairClass> wanted_classes(const ParetoOptions& options) {
  std::vector<PairClass> classes = pair_classes(options.seed);
  for (const std::string& name : options.pairs) {
    if (name == kFieldName || name == kRenderingName || name == kHeadlineName) continue;
    if (std::none_of(classes.begin(), classes.end(),
                     [&name](const PairClass& pair) { return pair.name == name; })) {
      throw tools::InputError("no pair class '" + name + "'; there are W1 to W6, " + kHeadlineName +
                              ", " + kFieldName + " and " + kRenderingName);
    }
  }
  if (options.pairs.empty()) return classes;
  std::erase_if(classes, [&options](const PairClass& pair) {
    return std::find(options.pairs.begin(), options.pairs.end(), pair.name) == options.pairs.end();
  });
  return classes;
}

/// Smallest difference between two measurements of nothing: what the counter advances by.
double clock_step_ns(const TickClock& clock) {
  std::set<std::uint64_t> counts;
  for (int k = 0; k < 20000; ++k) {
    const std::uint64_t begin = TickClock::now();
    counts.insert(TickClock::now() - begin);
  }
  std::uint64_t step = *counts.rbegin();
  for (auto next = std::next(counts.begin()); next != counts.end(); ++next)
    step = std::min(step, *next - *std::prev(next));
  return static_cast<double>(step) * clock.ns_per_count();
}

bool wants(const ParetoOptions& options, const char* name) {
  return options.pairs.empty() ||
         std::find(options.pairs.begin(), options.pairs.end(), name) != options.pairs.end();
}

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

std::vector<ParetoRow> ParetoResult::rows() const {
  std::vector<ParetoRow> all;
  for (const PairMeasure& pair : pairs) {
    for (const MethodMeasure& method : pair.methods)
      all.insert(all.end(), method.result.rows.begin(), method.result.rows.end());
  }
  for (const VisitBudget& budget : budgets)
    all.insert(all.end(), budget.result.rows.begin(), budget.result.rows.end());
  return all;
}

ParetoResult measure_pareto(const ParetoOptions& options) {
  ParetoResult result;
  result.options = options;
  result.plan = plan_of(options);
  const std::vector<PairClass> classes = wanted_classes(options);
  const TickClock clock;
  result.clock_empty_ns = clock.empty_ns();
  result.clock_step_ns = clock_step_ns(clock);
  if (wants(options, kHeadlineName))
    result.headline = measure_headline(result.plan, clock, options.quick, options.progress);
  for (const PairClass& pair : classes)
    result.pairs.push_back(measure_pair(pair, options, result.plan, clock));
  if (wants(options, kFieldName)) {
    say(options, "field of posts, budgets of pair visits");
    result.budgets = measure_visit_budgets(options.quick ? kQuickFieldPoses : kFullFieldPoses,
                                           options.seed, result.plan, clock);
  }
  if (wants(options, kRenderingName)) {
    say(options, "rendering: passes and tolerances of the proxy");
    result.rendering = measure_rendering(result.plan, clock, options.quick);
  }
  return result;
}

void write_pareto(const ParetoResult& result, const std::string& folder) {
  tools::claim_folder(folder, "--out", {});
  write_whole_file(folder + "/pareto.csv", pareto_csv(result.rows()));
  write_whole_file(folder + "/pareto.json", pareto_json(result));
  write_whole_file(folder + "/pareto.md", pareto_markdown(result));
  if (!result.pairs.empty()) {
    write_whole_file(folder + "/error_time.svg", error_time_plot(result));
    write_whole_file(folder + "/time_nodes.svg", time_nodes_plot(result));
    write_whole_file(folder + "/latency.svg", latency_plot(result));
  }
  if (!result.headline.empty()) {
    write_whole_file(folder + "/headline.csv", headline_table(result.headline).csv());
    write_whole_file(folder + "/headline.md", headline_markdown(result.headline));
    write_whole_file(folder + "/headline.svg", headline_plot(result.headline));
    for (const HeadlineMeasure& m : result.headline)
      write_whole_file(folder + "/headline_ticks_" + m.name + ".csv", headline_ticks_csv(m));
  }
  if (result.rendering.empty()) return;
  write_whole_file(folder + "/rendering.csv", rendering_table(result.rendering).csv());
  write_whole_file(folder + "/rendering.svg", rendering_plot(result.rendering));
}

}  // namespace haptic::sim
