// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pareto/pareto_report.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <system_error>

#include "host_sim/lab/optional/studies.hpp"
#include "host_sim/lab/pareto/headline_report.hpp"
#include "host_sim/report/part_report.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

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
    if (name == kHeadlineName || name == kOpponentsName) continue;
    if (std::none_of(classes.begin(), classes.end(),
                     [&name](const PairClass& pair) { return pair.name == name; })) {
      throw tools::InputError("no pair class '" + name + "'; there are W1 to W6, " + kHeadlineName +
                              " and " + kOpponentsName);
    }
    if (!studies_built()) throw tools::UsageError("--pairs: " + study_left_out(name));
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

}  // namespace

std::vector<ParetoRow> ParetoResult::rows() const {
  std::vector<ParetoRow> all;
  for (const PairMeasure& pair : pairs) {
    for (const MethodMeasure& method : pair.methods)
      all.insert(all.end(), method.result.rows.begin(), method.result.rows.end());
  }
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
  if (wants(options, kOpponentsName)) {
    OpponentPlan opponents;
    if (options.quick) {
      opponents.quick = true;
      opponents.repeats = 1;
      opponents.voxels_m = {4e-4, 2e-4};
    }
    for (const OpponentScene& scene : opponent_scenes(opponents))
      result.opponents.push_back(measure_opponents(scene, opponents, clock, options.progress));
  }
  result.pairs = measure_pairs(classes, options, result.plan, clock);
  return result;
}

void write_pareto(const ParetoResult& result, const std::string& folder) {
  tools::claim_folder(folder, "--out", {});
  write_whole_file(folder + "/pareto.csv", pareto_csv(result.rows()));
  write_whole_file(folder + "/pareto.json", pareto_json(result));
  write_whole_file(folder + "/pareto.md", pareto_markdown(result));
  for (const OutputText& file : pair_pictures(result))
    write_whole_file(folder + "/" + file.name, file.content);
  if (!result.opponents.empty()) {
    write_whole_file(folder + "/opponents.csv", opponent_table(result.opponents).csv());
    write_whole_file(folder + "/opponents.md", opponent_markdown(result.opponents));
  }
  if (!result.headline.empty()) {
    write_whole_file(folder + "/headline.csv", headline_table(result.headline).csv());
    write_whole_file(folder + "/headline.md", headline_markdown(result.headline));
    write_whole_file(folder + "/headline.svg", headline_plot(result.headline));
    for (const HeadlineMeasure& m : result.headline)
      write_whole_file(folder + "/headline_ticks_" + m.name + ".csv", headline_ticks_csv(m));
  }
}

}  // namespace haptic::sim
