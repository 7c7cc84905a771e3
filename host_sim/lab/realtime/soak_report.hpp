// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A soak as files.

#include <string>
#include <vector>

#include "host_sim/lab/realtime/soak_run.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// soak.csv (a line per second), soak_faults.csv (a line per fault), soak.json (the account),
/// soak.svg (force with the faults, memory, descriptors).
[[nodiscard]] std::vector<OutputText> soak_files(const std::string& scene,
                                                 const SoakSettings& settings,
                                                 const SoakAccount& account);

}  // namespace haptic::sim
