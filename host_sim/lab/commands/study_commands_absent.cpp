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
    CLI::App* app = program.add_subcommand(name, "Left out of this build.");
    app->footer(name + kStudiesLeftOut + ".");
    app->allow_extras();
    commands.push_back({app, [name]() -> int { throw tools::UsageError(name + kStudiesLeftOut); },
                        "cmake --preset release -DHAPTIC_BUILD_STUDIES=ON"});
  }
  return commands;
}

}  // namespace haptic::sim
