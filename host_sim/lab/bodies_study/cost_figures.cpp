// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/bodies_study/cost_figures.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <numeric>

#include "host_sim/lab/bodies_study/cost_cases.hpp"
#include "host_sim/report/quantile.hpp"

namespace haptic::sim {
namespace {

/// `ascending`: empty where nothing was measured.
double mean_of(const TickCounts& ascending) {
  if (ascending.empty()) return std::numeric_limits<double>::quiet_NaN();
  return std::accumulate(ascending.begin(), ascending.end(), 0.0) /
         static_cast<double>(ascending.size());
}

}  // namespace

TickCounts pressed_counts(const TickCounts& ticks) {
  TickCounts counts;
  if (ticks.size() > kPressedTick)
    counts.assign(ticks.begin() + static_cast<std::ptrdiff_t>(kPressedTick), ticks.end());
  std::ranges::sort(counts);
  return counts;
}

void add_spread(StudyRow& row, const std::string& name, const std::string& words,
                const TickCounts& ascending) {
  const std::string heading = words + ", mean / 99 % / largest";
  const bool known = !ascending.empty();
  const auto number = [&](double share) {
    return known ? static_cast<double>(quantile(ascending, share))
                 : std::numeric_limits<double>::quiet_NaN();
  };
  row.figures.push_back({name + "_mean", heading, mean_of(ascending)});
  row.figures.push_back({name + "_p99", heading, number(0.99)});
  row.figures.push_back({name + "_largest", heading, number(1)});
}

TickCounts pressed_instructions(const std::string& name, const InstructionQuestion& question) {
  const InstructionCounts counts = count_instructions(question);
  if (counts.measured) return pressed_counts(counts.profile.per_tick);
  std::fprintf(stderr, "%s: instructions not measured: %s\n", name.c_str(), counts.why_not.c_str());
  return {};
}

}  // namespace haptic::sim
