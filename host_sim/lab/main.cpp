// SPDX-License-Identifier: Apache-2.0
// host_lab: the laboratory. It verifies, times and compares the core; host_sim hands these commands
// on.
#include <CLI/App.hpp>
#include <utility>
#include <vector>

#include "host_sim/lab/commands/lab_commands.hpp"

int main(int argc, char** argv) {
  using namespace haptic;
  CLI::App program("Laboratory: verifies the core, times it and compares it with others.",
                   "host_lab");
  std::vector<sim::Command> commands = {
      sim::add_accept_command(program),       sim::add_bodies_command(program),
      sim::add_bodies_fuzz_command(program),  sim::add_calm_command(program),
      sim::add_compare_laws_command(program), sim::add_cost_command(program),
      sim::add_crossings_command(program),    sim::add_faults_command(program),
      sim::add_flight_command(program),       sim::add_friction_command(program),
      sim::add_growth_command(program),       sim::add_hold_command(program),
      sim::add_pareto_command(program),       sim::add_plan_sampled_command(program),
      sim::add_proxy_fuzz_command(program),   sim::add_soak_command(program),
      sim::add_stability_command(program),    sim::add_strangers_command(program),
      sim::add_surface_fuzz_command(program), sim::add_vectors_command(program),
      sim::add_verify_command(program),       sim::add_wcet_command(program)};
  for (sim::Command& study : sim::add_study_commands(program)) commands.push_back(std::move(study));
  return tools::run_program(program, commands, tools::kCommonExitCodes, argc, argv);
}
