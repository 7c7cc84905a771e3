// SPDX-License-Identifier: Apache-2.0
// Built without HAPTIC_BUILD_STUDIES: write_stability() has refused what names one of these parts.
#include "host_sim/lab/stability/stability_report.hpp"

namespace haptic::sim {

std::span<const StabilityPart> study_parts() { return {}; }

}  // namespace haptic::sim
