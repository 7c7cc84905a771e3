// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/stability_report.hpp"

namespace haptic::sim {

std::span<const StabilityPart> study_parts() {
  static constexpr StabilityPart kParts[] = {
      {1, "z_width", z_width_part},
      {4, "continuity", continuity_part},
      {5, "energy", energy_part},
      {6, "clearance", [](const StabilityOptions& o) { return clearance_part(o.quick); }},
      {7, "divisions", divisions_part},
  };
  return kParts;
}

}  // namespace haptic::sim
