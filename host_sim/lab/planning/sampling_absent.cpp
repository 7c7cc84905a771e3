// SPDX-License-Identifier: Apache-2.0
// Built where OMPL was not found.
#include <stdexcept>

#include "host_sim/lab/planning/sampling_planners.hpp"

namespace haptic::sim {

const std::vector<std::string>& sampling_planners() {
  static const std::vector<std::string> none;
  return none;
}

SamplingResult run_sampling_planner(const std::string& name, const SamplingProblem&, double,
                                    std::uint32_t) {
  throw std::invalid_argument("'" + name + "': this program was built without OMPL");
}

SamplingResult run_sliding_rrt(const SamplingProblem&, const SlideTowards&, double, double,
                               std::uint32_t) {
  throw std::invalid_argument("this program was built without OMPL");
}

}  // namespace haptic::sim
