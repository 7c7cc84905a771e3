// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The commands of host_lab, the laboratory.

#include <vector>

#include "tools/common/command_line.hpp"

namespace haptic::sim {

using tools::Command;

[[nodiscard]] Command add_accept_command(CLI::App& program);
[[nodiscard]] Command add_bodies_command(CLI::App& program);
[[nodiscard]] Command add_bodies_fuzz_command(CLI::App& program);
[[nodiscard]] Command add_calm_command(CLI::App& program);
[[nodiscard]] Command add_compare_laws_command(CLI::App& program);
[[nodiscard]] Command add_cost_command(CLI::App& program);
[[nodiscard]] Command add_crossings_command(CLI::App& program);
[[nodiscard]] Command add_faults_command(CLI::App& program);
[[nodiscard]] Command add_flight_command(CLI::App& program);
[[nodiscard]] Command add_friction_command(CLI::App& program);
[[nodiscard]] Command add_growth_command(CLI::App& program);
[[nodiscard]] Command add_hold_command(CLI::App& program);
[[nodiscard]] Command add_pareto_command(CLI::App& program);
[[nodiscard]] Command add_plan_sampled_command(CLI::App& program);
[[nodiscard]] Command add_proxy_fuzz_command(CLI::App& program);
[[nodiscard]] Command add_soak_command(CLI::App& program);
[[nodiscard]] Command add_stability_command(CLI::App& program);
[[nodiscard]] Command add_strangers_command(CLI::App& program);
[[nodiscard]] Command add_surface_fuzz_command(CLI::App& program);
[[nodiscard]] Command add_vectors_command(CLI::App& program);
[[nodiscard]] Command add_verify_command(CLI::App& program);
[[nodiscard]] Command add_wcet_command(CLI::App& program);

/// Those of lab/studies; without them commands of the same names that say how to get them.
[[nodiscard]] std::vector<Command> add_study_commands(CLI::App& program);

}  // namespace haptic::sim
