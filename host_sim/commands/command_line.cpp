// SPDX-License-Identifier: Apache-2.0
#include "host_sim/commands/command_line.hpp"

#include <CLI/CLI.hpp>

#include "tools/common/error.hpp"
#include "tools/common/run_main.hpp"

namespace haptic::sim {

int run_program(CLI::App& program, std::span<const Command> commands, int argc, char** argv) {
  const std::string name = program.get_name();
  program.require_subcommand(1);
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? tools::kExitDone : tools::kExitUsage;
  }
  return tools::run_main(name.c_str(), [&]() -> int {
    for (const Command& command : commands) {
      if (command.app->parsed()) return command.run();
    }
    return tools::kExitUsage;
  });
}

}  // namespace haptic::sim
