// SPDX-License-Identifier: Apache-2.0
// Built without HAPTIC_BUILD_STUDIES: the commands of the studies say how to get them.
#include <string>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/optional/studies.hpp"

namespace haptic::sim {

std::vector<Command> add_study_commands(CLI::App& program) {
  std::vector<Command> commands;
  for (const std::string name :
       {"guide-limits", "guide-study", "pegs", "planners", "rates", "reproduce-paper"}) {
    commands.push_back(tools::add_left_out_command(program, name, build_of_studies()));
  }
  return commands;
}

}  // namespace haptic::sim
