// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/commands/study_commands.hpp"

#include "host_sim/lab/commands/lab_commands.hpp"

namespace haptic::sim {

std::vector<Command> add_study_commands(CLI::App& program) {
  return {add_guide_limits_command(program), add_guide_study_command(program),
          add_pegs_command(program),         add_planners_command(program),
          add_rates_command(program),        add_reproduce_paper_command(program)};
}

}  // namespace haptic::sim
