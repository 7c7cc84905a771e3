// SPDX-License-Identifier: Apache-2.0
// Built without HAPTIC_BUILD_STUDIES: measure_pareto() has refused what names a pair.
#include "host_sim/lab/pareto/pareto_report.hpp"

namespace haptic::sim {

std::vector<PairMeasure> measure_pairs(std::span<const PairClass>, const ParetoOptions&,
                                       const MeasurePlan&, const TickClock&) {
  return {};
}

std::string pair_sections(const ParetoResult&) { return {}; }

std::vector<OutputText> pair_pictures(const ParetoResult&) { return {}; }

}  // namespace haptic::sim
