// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The commands of the studies.

#include "tools/common/command_line.hpp"

namespace haptic::sim {

using tools::Command;

[[nodiscard]] Command add_guide_limits_command(CLI::App& program);
[[nodiscard]] Command add_guide_study_command(CLI::App& program);
[[nodiscard]] Command add_pegs_command(CLI::App& program);
[[nodiscard]] Command add_planners_command(CLI::App& program);
[[nodiscard]] Command add_rates_command(CLI::App& program);
[[nodiscard]] Command add_reproduce_paper_command(CLI::App& program);

}  // namespace haptic::sim
