// SPDX-License-Identifier: Apache-2.0
#include "host_sim/commands/command_line.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "tools/common/error.hpp"

namespace haptic::sim {

int run_program(CLI::App& program, std::span<const Command> commands, int argc, char** argv) {
  const std::string name = program.get_name();
  program.require_subcommand(1);
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? tools::kExitDone : tools::kExitUsage;
  }
  try {
    for (const Command& command : commands) {
      if (command.app->parsed()) return command.run();
    }
  } catch (const tools::InputError& error) {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), error.what());
    return tools::kExitBadInput;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: the operating system refused: %s\n", name.c_str(), error.what());
    return tools::kExitDeviceOrOs;
  }
  return tools::kExitUsage;
}

}  // namespace haptic::sim
